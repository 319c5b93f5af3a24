"""Objects put into voids and pressed apart until exact booleans find nothing: what the kit's own searches share.

Eq. 4 and 5 and surface contact press; contact alone takes the rest; exact booleans judge. Eq. 5 acts only beyond the
wall here: with the paper's epsilon of 1 cm it presses together what lies along a wall.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np
import torch

from .. import poses, query_points
from ..exact.certificate import TOLERANCE
from ..exact.overlap_removal import mend
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..geometry.sdf import GridStack, bake_cached
from ..optimizer import Step, optimize
from ..poses import Poses, join
from ..problem import Problem, Settings
from ..scene import Scene
from .voxel_correlation import Room, Turned

VOID_CELLS = 5  # voxels along a mean object's radius, in which voids are looked for
VOIDS = 48, 128  # of them along the container's longest edge, at least and at most
TURNS = 16  # rotations looked at for each object
CANDIDATES = 4  # objects of which the one that shares least is taken
HOPELESS_SHARED = 0.15  # of a mean object's volume: objects that share more are not pressed in
HOPELESS_OVERLAP = 1e-4  # mean volumes times radii: Eq. 4 as a volume integral, after pressing
CHECKED = (15, 25, 40)  # iterations of pressing after which it may be given up
HELD = 8  # of the last tries that came free, the largest overlap then bounds what is pressed on
LEEWAY = 1.5  # times that overlap
POINTS = 30_000  # query points, at most: contact sees what lies between them
SETTLINGS = 2  # of what contact has not quite freed, the second helps half
NEARLY = 20 * TOLERANCE  # faults that exact booleans may still take away
STRICT = 0.95  # of the certificate's tolerance, for what rounding makes of volumes
RATE = 0.033  # of a mean object's radius: the first step while pressing
VICINITY = 48  # objects about a new one that move with it; a row of blocks makes room only where all of it moves
SIGHT = 0.5  # of a mean object's radius: how far about them the others are looked at
UNSEEN = 8  # pixels along the edge of silhouettes that do not count here
CLEARANCE = 6e-4  # contact margin, of the viewing width
SKIN = 3e-4  # of the viewing width: Eq. 5's epsilon


class Press:
    """Works on some of a pool's objects, given as indices into it and poses in their order, in a container.

    shareable : cubic metres that an object worth pressing in shares with others at most. hopeless : the overlap after
    pressing above which it is not worth going on. spent : says when time is over; pressing then ends, and nothing
    counts as settled.
    """

    def __init__(
        self,
        pool: Sequence[Body],
        container: Container,
        settings: Settings,
        device: torch.device,
        random: np.random.Generator,
        spent: Callable[[], bool],
    ):
        self.pool, self.settings, self.device = list(pool), settings, device
        self.random, self.spent = random, spent
        self.radius = float(np.mean([body.radius for body in pool]))
        mean = float(np.mean([body.volume for body in pool]))
        self.shareable, self.hopeless = HOPELESS_SHARED * mean, HOPELESS_OVERLAP * mean * self.radius
        self.stack = GridStack.of_bodies(pool, device)
        distinct = {body.digest: body for body in pool}
        self.grids = {digest: bake_cached(body) for digest, body in distinct.items()}
        self.half = torch.tensor(np.array([body.half_extents for body in pool]), device=device).float()
        self.history: list[np.ndarray] = []
        self._course: dict[int, float] = {}  # of the try under way: overlap at the iterations of CHECKED
        self._held: deque[dict[int, float]] = deque(maxlen=HELD)  # of the last tries that came free
        self.enter(container)

    def enter(self, container: Container) -> None:
        """Work in this container from now on."""
        self.container, self.cameras = container, container.views()
        self.width = max(camera.width for camera in self.cameras)
        edge = float(np.ptp(container.bounds, axis=0).max())
        self.room = Room(container, edge / np.clip(edge / self.radius * VOID_CELLS, *VOIDS), margin=0.0)
        self._looked: tuple[Poses | None, np.ndarray | None] = None, None
        self._scene: tuple[list[int], Scene] | None = None

    # -- voids -------------------------------------------------------------------------------------------------------

    def look(self, chosen: list[int], start: Poses, without: int | None = None) -> None:
        """Note where these objects lie, but for the one at place `without`, for `least_shared`."""
        if self._looked[0] is not start:
            self._looked = start, self._occupancy(chosen, start)
        taken = self._looked[1]
        if without is not None:
            taken = taken - self._occupancy([chosen[without]], start.take([without]))
        self.room.clear(taken > 0)

    def _occupancy(self, chosen: list[int], start: Poses) -> np.ndarray:
        """How many objects each of the room's voxels has its middle in."""
        if not chosen:
            return np.zeros(self.room.shape, np.int16)
        origin = torch.tensor(self.room.origin + self.room.voxel / 2, device=self.device).float()
        lattice = query_points.Lattice(origin, self.room.voxel, tuple(map(int, self.room.shape)), None)
        place = (x.to(self.device).float() for x in (start.rotation, start.translation))
        return query_points.occupancy(self.stack.take(chosen), self.half[chosen], *place, lattice).cpu().numpy()

    def least_shared(self, candidates: Iterable[int], least: float) -> tuple[int, Poses, float] | None:
        """The object, its pose, and the volume in cubic metres that it shares with what `look` saw: the least of all;
        None where all share `least` or more."""
        found = None
        for index in map(int, candidates):
            place = self.room.least_shared(self._turned(index))
            if place is not None and place[2] < least:
                found, least = (index, *place[:2]), place[2]
        if found is None:
            return None
        index, turned, shift = found
        centre = self.room.centre(turned, shift)
        return index, Poses(torch.from_numpy(turned.rotation)[None], torch.from_numpy(centre)[None]), least

    def add(self, chosen: list[int], start: Poses, count: int, least: float) -> tuple[list[int], Poses]:
        """Up to `count` objects of the pool more: each the one of CANDIDATES that shares least with the others, and
        less than `least` cubic metres."""
        for _ in range(min(count, len(self.pool) - len(chosen))):
            rest = np.setdiff1d(np.arange(len(self.pool)), chosen)
            self.look(chosen, start)
            found = self.least_shared(self.random.choice(rest, min(CANDIDATES, len(rest)), replace=False), least)
            if found is None:
                break
            chosen, start = [*chosen, found[0]], join(start, found[1])
        return chosen, start

    def _turned(self, index: int) -> Iterable[Turned]:
        """An object of the pool in random rotations, as voxels."""
        body = self.pool[index]
        generator = torch.Generator().manual_seed(int(self.random.integers(2**31)))
        for rotation in poses.quaternion_to_rotation(poses.random_quaternions(TURNS, generator, torch.float64)).numpy():
            yield Turned.filling(self.grids[body.digest], body.half_extents, rotation, self.room.voxel)

    # -- pressing ----------------------------------------------------------------------------------------------------

    def vicinity(self, chosen: list[int], start: Poses, fresh: int) -> list[int]:
        """Which of the objects move when the last `fresh` of them are pressed in: the nearest about each."""
        centre, radius = start.translation.double().numpy(), np.array([self.pool[index].radius for index in chosen])
        away = np.linalg.norm(centre[:, None] - centre[None, len(chosen) - fresh :], axis=-1) - radius[:, None]
        return np.unique(np.argsort(away, axis=0)[:VICINITY]).tolist()

    def press_in(
        self, chosen: list[int], start: Poses, seed: int, fresh: int | None = None, patient: bool = False
    ) -> Poses | None:
        """Press apart the objects about the last `fresh` of them, or all, until they hold; None where they do not come
        to that. patient : also where it looks hopeless."""
        movers = None if fresh is None else self.vicinity(chosen, start, fresh)
        start, overlap = self.apart(chosen, start, seed, movers)
        return self.settle(chosen, start, seed, movers) if patient or overlap <= self.hopeless else None

    def apart(self, chosen: list[int], start: Poses, seed: int, movers: list[int] | None = None) -> tuple[Poses, float]:
        """Press the objects apart; the poses, and the overlap left: the integral of its depth, metres to the fourth.

        movers : the objects that may move, as places in `chosen`; all where None.
        """
        press = replace(self._settle_settings(seed), overlap_weight=1.0, lambda_=3.0, iterations=80)
        rate = 3 * press.learning_rate
        unit, recent = self.container.volume / press.query_points, deque(maxlen=5)
        self._course = {}

        def hopeless(step: Step) -> bool:
            recent.append(step.losses[2].item())
            if step.iteration not in CHECKED:
                return False
            self._course[step.iteration] = overlap = sum(recent) / len(recent) * unit
            if len(self._held) < HELD:
                return False
            return overlap > max(self.hopeless, LEEWAY * max(course[step.iteration] for course in self._held))

        press = replace(press, learning_rate=rate, final_learning_rate=rate / 6)
        start = self._arrange(chosen, start, press, movers, hopeless)
        return start, sum(recent) / max(1, len(recent)) * unit

    def settle(self, chosen: list[int], start: Poses, seed: int, movers: list[int] | None = None) -> Poses | None:
        """Take the last thin overlaps away, by contact alone, then by exact booleans; None where they do not go."""
        bodies = [self.pool[index] for index in chosen]
        for again in range(SETTLINGS):
            start = self._arrange(chosen, start, self._settle_settings(seed + again), movers)
            if self.spent():
                return None
            mended = mend(bodies, start, self.container, STRICT * TOLERANCE, NEARLY, movers)
            if mended is not None:
                if len(self._course) == len(CHECKED):
                    self._held.append(self._course)
                return mended
        return None

    def _settle_settings(self, seed: int) -> Settings:
        rate = RATE / 3 * self.radius / self.width
        return replace(
            self.settings,
            iterations=60,
            resolution=UNSEEN,
            learning_rate=rate,
            final_learning_rate=rate / 20,
            silhouette_weight=0.0,
            overlap_weight=0.0,
            lambda_=0.0,
            epsilon=SKIN * self.width,
            contact_weight=1.0,
            contact_margin=CLEARANCE * self.width,
            query_points=min(POINTS, self.settings.query_points),
            seed=seed,
        )

    def _arrange(
        self, chosen, start: Poses, settings: Settings, movers, ends: Callable[[Step], bool] | None = None
    ) -> Poses:
        """Optimise the movers among those that they may come to meet; the poses of all."""
        movers = range(len(chosen)) if movers is None else movers
        seen = [*movers, *self._obstacles(chosen, start, movers)]
        indices, obstacles = [chosen[i] for i in seen], len(seen) - len(movers)
        bodies = [self.pool[index] for index in indices]
        if self._scene is None or self._scene[0] != (indices, obstacles):
            stack = self.stack.take(indices)
            made = Scene(bodies, self.container, self.cameras, self.device, obstacles=obstacles, stack=stack)
            self._scene = (indices, obstacles), made
        problem = Problem(bodies, self.container, obstacles=obstacles)
        ended = False

        def after(step: Step) -> bool:
            nonlocal ended
            ended = self.spent() or (ends is not None and ends(step))
            return ended

        run = optimize(problem, settings, start.take(seen), self.device, scene=self._scene[1], callback=after)
        if run.interrupted and not ended:
            raise KeyboardInterrupt
        self.history.append(run.history)
        rotation, translation = start.rotation.double().clone(), start.translation.double().clone()
        rotation[seen], translation[seen] = run.rotation, run.translation
        return Poses(rotation, translation)

    def _obstacles(self, chosen: list[int], start: Poses, movers: Sequence[int]) -> list[int]:
        """The other objects whose boxes lie within SIGHT of a mover's."""
        rest = np.setdiff1d(np.arange(len(chosen)), movers)
        reach = (start.rotation.double().abs() @ self.half[chosen].double()[:, :, None])[:, :, 0].numpy()
        reach, centre = reach + SIGHT * self.radius / 2, start.translation.double().numpy()
        apart = np.abs(centre[rest][:, None] - centre[movers][None]) > reach[rest][:, None] + reach[movers][None]
        return rest[(~apart.any(-1)).any(1)].tolist()
