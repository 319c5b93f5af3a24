"""Objects put into voids: where one overlaps least with those that are there, and which of these then make room.

Voids are looked for in voxels: of random rotations and all positions, that which shares least (`voxel_correlation`).
What is too long for all of these is turned as the container's diagonals run (`slant`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import torch

from .. import poses, query_points
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..geometry.sdf import GridStack, bake_cached
from ..poses import Poses
from .layout import Layout
from .slant import fits_straight, slanted_turns
from .voxel_correlation import Room, Turned


@dataclass(frozen=True)
class InsertionTuning:
    """What the search for voids was tuned to."""

    voxels_per_mean_radius: int = 5
    fewest_voxels_along_container: int = 48  # along its longest edge
    most_voxels_along_container: int = 128
    rotations_per_object: int = 16
    candidates_per_object: int = 4  # of which the one that shares least is taken
    most_shared_of_mean_volume: float = 0.15  # objects that share more are not worth pressing apart
    movers_per_object: int = 48  # a row of blocks makes room only if all of it moves


TUNING = InsertionTuning()


@dataclass(frozen=True)
class Occupancy:
    """How many objects of a layout each voxel of the container has its middle in, `(X, Y, Z)` int."""

    layout: Layout
    counts: np.ndarray


@dataclass(frozen=True)
class Insertion:
    """An object of the pool, its pose, and the volume in cubic metres that it shares with others there."""

    index: int
    pose: Poses
    shared: float


class Voids:
    """The voids that a pool's objects leave in a container.

    random : draws rotations and candidates. stack : the pool's grids, if they are at hand. most_shared : cubic metres
    that an object worth pressing in shares with others at most.
    """

    def __init__(
        self,
        pool: Sequence[Body],
        container: Container,
        device: torch.device,
        random: np.random.Generator,
        stack: GridStack | None = None,
    ):
        self.pool, self.container, self.device, self.random = list(pool), container, device, random
        self.stack = stack or GridStack.of_bodies(pool, device)
        self.grids = {body.digest: bake_cached(body) for body in {body.digest: body for body in pool}.values()}
        self.half = torch.tensor(np.array([body.half_extents for body in pool]), device=device).float()
        self.radii = np.array([body.radius for body in pool])
        self.most_shared = TUNING.most_shared_of_mean_volume * float(np.mean([body.volume for body in pool]))
        edge = float(np.ptp(container.bounds, axis=0).max())
        along = np.clip(
            edge / float(np.mean(self.radii)) * TUNING.voxels_per_mean_radius,
            TUNING.fewest_voxels_along_container,
            TUNING.most_voxels_along_container,
        )
        self.room = Room(container, edge / along, margin=0.0)
        self.slants: dict[str, np.ndarray] = {}

    def occupancy(self, layout: Layout) -> Occupancy:
        """Where the objects of a layout lie, in voxels."""
        if not len(layout):
            return Occupancy(layout, np.zeros(self.room.shape, np.int16))
        origin = torch.tensor(self.room.origin + self.room.voxel / 2, device=self.device).float()
        lattice = query_points.Lattice(origin, self.room.voxel, tuple(map(int, self.room.shape)), None)
        counts = query_points.occupancy(
            self.stack.take(layout.chosen),
            self.half[layout.chosen],
            layout.poses.rotation.to(self.device).float(),
            layout.poses.translation.to(self.device).float(),
            lattice,
        )
        return Occupancy(layout, counts.cpu().numpy())

    def occupancy_without(self, occupancy: Occupancy, position: int | None) -> Occupancy:
        """The same without the object at a position in `layout.chosen`; the same if None."""
        if position is None:
            return occupancy
        one = self.occupancy(occupancy.layout.take([position]))
        return Occupancy(occupancy.layout.without(position), occupancy.counts - one.counts)

    def least_shared(self, occupancy: Occupancy, candidates: Iterable[int], most: float) -> Insertion | None:
        """Of the pool's objects `candidates`, the one that shares least with those that are there, and where.

        None if each shares `most` cubic metres or more.
        """
        self.room.clear(occupancy.counts > 0)
        found, least = None, most
        for index in map(int, candidates):
            fit = self.room.least_shared(self._turned(index)) or self.room.least_shared(self._slanted(index))
            if fit is not None and fit[2] < least:
                turned, shift, least = fit
                found = index, turned, shift
        if found is None:
            return None
        index, turned, shift = found
        centre = self.room.centre(turned, shift)
        return Insertion(index, Poses(torch.from_numpy(turned.rotation)[None], torch.from_numpy(centre)[None]), least)

    def fill(self, layout: Layout, count: int) -> Layout:
        """The layout and up to `count` objects more, each the one of a few that shares least with the others, and less
        than `most_shared`."""
        for _ in range(min(count, len(self.pool) - len(layout))):
            rest = np.setdiff1d(np.arange(len(self.pool)), layout.chosen)
            few = self.random.choice(rest, min(TUNING.candidates_per_object, len(rest)), replace=False)
            found = self.least_shared(self.occupancy(layout), few, self.most_shared)
            if found is None:
                break
            layout = layout.added(found.index, found.pose)
        return layout

    def neighbours(self, layout: Layout, inserted: int) -> list[int]:
        """Positions in `layout.chosen` of the objects that make room for the last `inserted` of them, these included:
        the nearest about each."""
        centre, radius = layout.poses.translation.double().numpy(), self.radii[layout.chosen]
        away = np.linalg.norm(centre[:, None] - centre[None, len(layout) - inserted :], axis=-1) - radius[:, None]
        return np.unique(np.argsort(away, axis=0)[: TUNING.movers_per_object]).tolist()

    def _turned(self, index: int) -> Iterable[Turned]:
        """An object of the pool in random rotations, as voxels."""
        body = self.pool[index]
        if body.wishes.turns is not None:
            turns = [body.wishes.turns.random(self.random) for _ in range(TUNING.rotations_per_object)]
            yield from self._filled(body, np.unique(turns, axis=0))
            return
        generator = torch.Generator().manual_seed(int(self.random.integers(2**31)))
        quaternions = poses.random_quaternions(TUNING.rotations_per_object, generator, torch.float64)
        yield from self._filled(body, poses.quaternion_to_rotation(quaternions).numpy())

    def _slanted(self, index: int) -> Iterable[Turned]:
        """An object of the pool too long to lie straight, as the container's diagonals run, as voxels."""
        body = self.pool[index]
        if body.wishes.turns is not None:
            return
        if body.digest not in self.slants:
            straight = fits_straight(body, self.container)
            self.slants[body.digest] = np.empty((0, 3, 3)) if straight else slanted_turns(body, self.container)
        yield from self._filled(body, self.slants[body.digest])

    def _filled(self, body: Body, rotations: np.ndarray) -> Iterable[Turned]:
        for rotation in rotations:
            yield Turned.filling(self.grids[body.digest], body.half_extents, rotation, self.room.voxel)
