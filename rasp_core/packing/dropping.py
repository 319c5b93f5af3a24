"""More objects dropped from above onto a packing, by a map of its heights (`constructive`, rule heightmap)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..geometry.containers import Container, FreeBox
from ..geometry.growing import shrunk
from ..geometry.meshes import Body
from ..geometry.zones import box_of
from ..poses import file_to_world
from ..util import o3d
from ..util.errors import InputError
from .clearance import Clearance
from .constructive import Placement

COVERED = 3**0.5 / 2  # of a voxel's edge: what is nearer to its middle may be in it
MOST_GROWN = 400  # voxels, that a box grows by at most


def drop(
    pool: Sequence[Body],
    over: Sequence[int],
    chosen: Sequence[int],
    matrices: np.ndarray,
    container: Container,
    clearance: Clearance | None = None,
    shape: FreeBox | None = None,
) -> tuple[list[tuple[int, np.ndarray]], np.ndarray, Container]:
    """Those of the pool's objects `over` that find room above those `chosen`, placed by `matrices` `(N, 4, 4)`.

    Returns indices and matrices in the order of dropping, the matrices of those that were there, and the container:
    larger along a free edge of `shape` where all are to go in, the others then as far from its lowest corner as
    before. clearance : of the pool, which is kept. Raises InputError if a box cannot grow so that all go in.
    """
    if not over:
        return [], matrices, container
    most, margin, more = 0.0, 0.0, [pool[i] for i in over]
    if clearance is not None:
        most, margin = float(clearance.parts.max()), clearance.margin
        more = [clearance.grown(i, pool[i]) for i in over]
    placement = Placement(more, shrunk(container, margin), rule="heightmap", straight=shape is not None)
    voxel, full = placement.room.voxel, _columns(placement, pool, chosen, matrices, most)
    size = container.base.size
    for _ in range(MOST_GROWN):
        spare = [(0, n - f) for n, f in zip(placement.room.shape, full.shape, strict=True)]
        placement.room.walls |= np.pad(full, spare)
        placement.fill()
        if shape is None or len(placement.placed) == len(over):
            break
        step = voxel * _growing(shape, size)
        size, matrices = size + step, matrices.copy()
        matrices[:, :3, 3] -= step / 2
        placement.enter(shrunk(box_of(shape, size), margin), keep=True)
    else:
        raise InputError("not all objects find room above each other in a box that grows; leave out --separable")
    if not placement.placed:
        return [], matrices, container
    poses = placement.poses
    placed = file_to_world([more[k] for k in placement.placed], poses.rotation, poses.translation)
    found = [(over[k], matrix) for k, matrix in zip(placement.placed, placed, strict=True)]
    return found, matrices, container if shape is None else box_of(shape, size)


def _growing(shape: FreeBox, size: np.ndarray) -> np.ndarray:
    """`(3,)`: 1 for the edges that grow: all of a cube, the height if that is free, else the shortest."""
    if shape.cube:
        return np.ones(3)
    axis = 2 if shape.free[2] else int(np.where(shape.free, size, np.inf).argmin())
    return (np.arange(3) == axis).astype(float)


def _columns(
    placement: Placement, pool: Sequence[Body], chosen: Sequence[int], matrices: np.ndarray, clearance: float
) -> np.ndarray:
    """`(X, Y, Z)` bool: the room's voxels that are in, beside or below a body."""
    room = placement.room
    middles = room.origin + room.voxel * (np.stack(np.indices(tuple(room.shape)), -1) + 0.5)
    scene = o3d.caster((pool[i].placed(m), pool[i].solid_faces) for i, m in zip(chosen, matrices, strict=True))
    distance = scene.compute_distance(middles.astype(np.float32)).numpy()
    near = distance < COVERED * room.voxel + clearance
    return np.maximum.accumulate(near[:, :, ::-1], axis=2)[:, :, ::-1]
