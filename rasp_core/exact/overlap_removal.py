"""Exact booleans push apart what still overlaps by a hair, where signed distance grids see nothing any more.

Where bodies A and B share a volume V, a move of A changes V by the area vectors of that part of A's surface that bounds
it: dV = S . shift + T . turn, with S the sum of the area vectors and T that of their moments about A's centre. A step
of Newton's method down that gradient halves a thin V at least.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import manifold3d
import numpy as np
import torch

from ..geometry.containers import Container
from ..geometry.growing import SPARE
from ..geometry.meshes import Body
from ..poses import Poses, angles_to_rotation, file_to_world, freedom_of
from .certificate import TOLERANCE, pairs_of_boxes
from .placing import core_inside, cores_apart, placed_solid

MOST_SWEEPS = 25
PATIENCE_SWEEPS = 6  # in which the worst fault must fall
FALLEN_TO = 0.8  # of what it was, at most
REPAIR_TOLERANCE = 0.95 * TOLERANCE  # what searches ask for: a little less than certified, as rounding changes volumes
STRICT_STEP = 1.5  # of Newton's step, for grown bodies, so that it comes to an end
REPAIRABLE_FRACTION = 20 * TOLERANCE  # of the smaller body's volume: faults that are worth the attempt


@dataclass(frozen=True)
class _Fault:
    """A solid that should be empty: where two bodies share space, or one is outside the container.

    movers : indices of the bodies that bound it. volume : cubic metres. fraction : of the smaller body's volume.
    strict : of grown bodies, of which none is tolerated.
    """

    movers: tuple[int, ...]
    solid: manifold3d.Manifold
    volume: float
    fraction: float
    strict: bool


def remove_overlaps(
    bodies: Sequence[Body],
    poses: Poses,
    container: Container,
    tolerance: float = TOLERANCE,
    largest: float = np.inf,
    movers: Sequence[int] | None = None,
) -> Poses | None:
    """Move bodies that overlap or stick out a little, until none does by more than `tolerance` of its volume.

    Returns the poses for which exact booleans find that, float64, or None if the faults do not get smaller. For faults
    of some thousandths of a volume: what begins with one above `largest`, a fraction of the smaller body's volume, is
    given up at once. There are at most MOST_SWEEPS sweeps, in which all bodies at fault move at once. movers : indices
    of the bodies that may move, all if None; what the others have among themselves is taken as it is. Grown bodies are
    moved until those inside them are as far apart as they are grown, and a hair more.
    """
    found, left = _removed(bodies, poses, container, tolerance, largest, movers)
    return None if left else found


def held_without(
    bodies: Sequence[Body], poses: Poses, container: Container, most: int, late: Callable[[], bool] = lambda: False
) -> tuple[list[int], Poses] | None:
    """Overlaps removed as by `remove_overlaps`, and where they do not go, the bodies that are most at fault taken out,
    one after the other.

    Returns the indices of those that are left, and their poses; None if more than `most` would be taken out, or where
    it is `late`.
    """
    kept = list(range(len(bodies)))
    while True:
        poses, faults = _removed([bodies[i] for i in kept], poses, container, REPAIR_TOLERANCE)
        if not faults:
            return kept, poses
        if len(bodies) - len(kept) >= min(most, len(bodies) - 1) or late():
            return None
        at_fault = np.zeros(len(kept))
        for fault in faults:
            at_fault[list(fault.movers)] += fault.fraction
        rest = np.delete(np.arange(len(kept)), at_fault.argmax())
        kept, poses = [kept[i] for i in rest], poses.take(rest.tolist())


def _removed(
    bodies: Sequence[Body],
    poses: Poses,
    container: Container,
    tolerance: float,
    largest: float = np.inf,
    movers: Sequence[int] | None = None,
) -> tuple[Poses, list[_Fault]]:
    """What `remove_overlaps` comes to, and the faults that are left."""
    rotation, translation = poses.rotation.double(), poses.translation.double()
    reach = [body.radius for body in bodies]
    movable = np.isin(np.arange(len(bodies)), np.arange(len(bodies)) if movers is None else movers)
    freedom = freedom_of(bodies)
    faults, worst_of = _Faults(bodies, container, movable), []
    for _ in range(MOST_SWEEPS):
        found = faults.at(Poses(rotation, translation))
        worst_of.append(max((fault.fraction for fault in found), default=0.0))
        if worst_of[-1] <= tolerance and not any(fault.strict for fault in found):
            return Poses(rotation, translation), []
        if worst_of[0] > largest:
            break
        if len(worst_of) > PATIENCE_SWEEPS and worst_of[-1] > FALLEN_TO * worst_of[-1 - PATIENCE_SWEEPS]:
            break
        shift, turn = torch.zeros_like(translation), torch.zeros_like(translation)
        for fault in found:
            if fault.fraction < tolerance / 2 and not fault.strict:
                continue
            step = fault.volume * (STRICT_STEP if fault.strict else 1)
            free = [i for i in fault.movers if movable[i]]
            slopes = [(i, *_slope(fault.solid, faults.solids[i], translation[i].numpy())) for i in free]
            if freedom is not None:
                slopes = [(i, force, moment * freedom[i]) for i, force, moment in slopes]
            steep = sum(force @ force + moment @ moment / reach[i] ** 2 for i, force, moment in slopes)
            if steep > 0:
                for i, force, moment in slopes:
                    shift[i] -= torch.from_numpy(step / steep * force)
                    turn[i] -= torch.from_numpy(step / steep / reach[i] ** 2 * moment)
        translation = translation + shift
        rotation = torch.where((turn != 0).any(1)[:, None, None], angles_to_rotation(turn) @ rotation, rotation)
    return Poses(rotation, translation), found


class _Faults:
    """The faults of bodies in a container; asked again, only those are tested whose bodies have moved."""

    def __init__(self, bodies: Sequence[Body], container: Container, movable: np.ndarray):
        self.bodies, self.container, self.movable = bodies, container, movable
        self.hull = container.body.manifold.translate(container.body.centre)
        self.matrices = np.full((len(bodies), 4, 4), np.nan)
        self.solids: list[manifold3d.Manifold] = [None] * len(bodies)
        self.found: dict[tuple[int, ...], _Fault] = {}

    def at(self, poses: Poses) -> list[_Fault]:
        """The faults of the bodies at some poses."""
        matrices = file_to_world(self.bodies, poses.rotation, poses.translation)
        moved = set(np.flatnonzero((matrices != self.matrices).any((1, 2))).tolist())
        self.matrices = matrices
        for i in moved:
            # each body is an original of its own, so that its part of a boolean's surface can be told
            self.solids[i] = placed_solid(self.bodies[i], matrices[i]).as_original()
        boxes = np.array([solid.bounding_box() for solid in self.solids]).reshape(-1, 2, 3)
        self.found = {movers: fault for movers, fault in self.found.items() if not moved & set(movers)}
        for i, j in pairs_of_boxes(boxes):
            if (i in moved or j in moved) and (self.movable[i] or self.movable[j]):
                self._note((i, j), self.solids[i] ^ self.solids[j])
        for i in filter(self.movable.__getitem__, moved):
            size = self.container.size
            if size is None or (np.abs(boxes[i]) > size / 2).any():
                self._note((i,), self.solids[i] - self.hull)
        return list(self.found.values())

    def _note(self, movers: tuple[int, ...], solid: manifold3d.Manifold) -> None:
        volume = solid.volume()
        if volume <= 0:
            return
        strict = any(self.bodies[i].grown for i in movers)
        if strict and self._clear(*movers):
            return
        fraction = volume / min(self.bodies[i].volume for i in movers)
        self.found[movers] = _Fault(movers, solid, volume, fraction, strict)

    def _clear(self, one: int, *other: int) -> bool:
        """Whether what is inside grown bodies is as far apart, or from the wall, as they are grown."""
        if other:
            return cores_apart(self.bodies, self.matrices, one, *other, SPARE / 2)
        return core_inside(self.bodies[one], self.matrices[one], self.container, SPARE / 2)


def _slope(
    common: manifold3d.Manifold, solid: manifold3d.Manifold, centre: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """How the volume of `common` grows with shifts `(3,)` of a solid that bounds it, and with turns about `centre`."""
    mesh = common.to_mesh64()
    corners = np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts)]
    runs = np.diff(np.asarray(mesh.run_index)) // 3
    own = np.repeat(np.asarray(mesh.run_original_id), runs) == solid.original_id()
    a, b, c = corners[own].transpose(1, 0, 2)
    areas = np.cross(b - a, c - a) / 2
    return areas.sum(0), np.cross((a + b + c) / 3 - centre, areas).sum(0)
