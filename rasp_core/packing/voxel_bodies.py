"""Bodies as the voxels whose middle they hold, which in the mean are neither too many nor too few; runs of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..geometry.containers import FreeBox
from ..geometry.meshes import Body
from ..geometry.surface_points import surface_points
from ..util import o3d
from .voxel_correlation import Turned

if TYPE_CHECKING:
    from ..kernels.voxel_runs import Voxels


@dataclass(frozen=True)
class VoxelBodyTuning:
    """How bodies are rounded to voxels."""

    thin: float = 0.8  # of an object's volume that its voxels must have; else all count that it touches
    rounded_off: float = 0.1  # voxels by which an object may be longer than its voxels
    points_of_voxel_face: float = 12.0  # at which a body's thickness is measured
    most_points: int = 200_000
    coarsest: float = 1.3  # times the voxel that is asked for: the one is taken that rounds least
    sizes_tried: int = 60
    first_of_likely_edge: float = 1 / 64  # of a cube as dense as is likely
    likely_density: float = 0.6
    beside_middle: tuple[float, float, float] = (3.1e-4, 5.3e-4, 7.7e-4)  # voxels: no point lies in a face's plane


TUNING = VoxelBodyTuning()


@dataclass(frozen=True)
class VoxelBody:
    """A body turned by `rotation` `(3, 3)`, in voxels.

    size `(3,)`; runs `(R, 4)`, columns `(X + 1,)` and below `(X, Y, Z + 1)` as `kernels.voxel_runs.Voxels` has them;
    coarse : the means of its voxels in coarse cells. centre `(3,)` : from the first voxel's corner, metres.
    """

    rotation: np.ndarray
    size: np.ndarray
    runs: np.ndarray
    columns: np.ndarray
    below: np.ndarray
    coarse: np.ndarray
    centre: np.ndarray


def first_size(bodies: Sequence[Body], shape: FreeBox, taken: float, cubes: float | None) -> float:
    """A voxel's edge in metres for a search that begins.

    taken : the bodies' volume, cubic metres. cubes : edge of the equal cubes of which all bodies are made, None if they
    are not.
    """
    if cubes is not None:
        return cubes
    return choose_size(bodies, shape, TUNING.first_of_likely_edge * (taken / TUNING.likely_density) ** (1 / 3))


def choose_size(bodies: Sequence[Body], shape: FreeBox, voxel: float) -> float:
    """A voxel's edge in metres, `voxel` or a little more: it rounds the bodies and the box's given edges least."""
    edges = np.concatenate([2 * body.half_extents for body in bodies])
    given = np.array([edge for edge in shape.edges if edge is not None])

    def waste(size: float) -> float:
        lost = _in_voxels(edges, size) * size / edges
        return 3 * lost.mean() + float((given / (whole(given, size) * size)).sum())

    return min(voxel * np.linspace(1, TUNING.coarsest, TUNING.sizes_tried), key=waste)


def whole(edges: np.ndarray, voxel: float) -> np.ndarray:
    """Voxels that lie within a box's edges, metres; one at least along each."""
    return np.maximum(np.floor(edges / voxel + 1e-6).astype(np.int64), 1)


def filled(body: Body, rotation: np.ndarray, voxel: float) -> Turned:
    """The voxels whose middle lies in a turned body, about the middle of its box.

    Where the body is thinner than a voxel, so that middles miss it, the voxels count that hold its own middle; if even
    these are few, all that it touches.
    """
    vertices, faces = body.solid_vertices @ rotation.T, body.solid_faces
    low, size = vertices.min(0), np.ptp(vertices, axis=0)
    shape = _in_voxels(size, voxel)
    corner = low + size / 2 - shape * voxel / 2
    scene = o3d.caster([(vertices, faces)])
    middles = corner + voxel * (np.stack(np.indices(shape), -1) + 0.5 + TUNING.beside_middle)
    voxels = scene.compute_occupancy(middles.astype(np.float32)).numpy() > 0
    area = body.manifold.surface_area()
    count = min(int(TUNING.points_of_voxel_face * area / voxel**2) + 1, TUNING.most_points)
    points, normals = surface_points(vertices, faces, count)
    thickness = o3d.depths(scene, points, -normals, TUNING.beside_middle[0] * voxel)
    thin = thickness < voxel
    within = points[thin] - normals[thin] * thickness[thin, None] / 2
    voxels[tuple(np.clip(((within - corner) / voxel).astype(int), 0, shape - 1).T)] = True
    if voxels.sum() * voxel**3 < TUNING.thin * body.volume:
        return Turned.covering(body, rotation, voxel)
    return Turned(rotation, voxels, -corner)


def without_overhangs(turned: Turned) -> Turned:
    """A body with all that lies between two of its voxels, one above the other. What shares nothing with that comes out
    straight up, unless some lie above each other in a ring."""
    voxels = turned.voxels
    over = np.maximum.accumulate(voxels, axis=2)
    under = np.maximum.accumulate(voxels[:, :, ::-1], axis=2)[:, :, ::-1]
    return Turned(turned.rotation, over & under, turned.centre)


def in_runs(turned: Turned, cell: int) -> VoxelBody:
    """A body's voxels as runs; cell : edge of the coarse cells, voxels."""
    voxels = turned.voxels
    padded = np.pad(voxels.astype(np.float32), [(0, -n % cell) for n in voxels.shape])
    x, y, z = (n // cell for n in padded.shape)
    coarse = padded.reshape(x, cell, y, cell, z, cell).mean((1, 3, 5))
    edges = np.diff(np.pad(voxels, ((0, 0), (0, 0), (1, 1))).astype(np.int8), axis=2)
    runs = np.ascontiguousarray(np.column_stack([np.argwhere(edges == 1), np.argwhere(edges == -1)[:, 2]]), np.int32)
    columns = np.searchsorted(runs[:, 0], np.arange(len(voxels) + 1))
    below = np.pad(voxels.cumsum(2, np.int16), ((0, 0), (0, 0), (1, 0)))
    return VoxelBody(turned.rotation, np.array(voxels.shape), runs, columns, below, coarse, turned.centre)


def laid_out(bodies: Sequence[VoxelBody]) -> Voxels:
    """Turned bodies, one after the other, for compiled loops."""
    from ..kernels.voxel_runs import Voxels

    def begins(lengths: Sequence[int]) -> np.ndarray:
        return np.concatenate([[0], np.cumsum(lengths)[:-1]])

    begin = begins([len(body.runs) for body in bodies])
    return Voxels(
        sizes=np.array([body.size for body in bodies]),
        runs=np.concatenate([body.runs for body in bodies]),
        begin=begin,
        end=begin + [len(body.runs) for body in bodies],
        columns=np.concatenate([first + body.columns for first, body in zip(begin, bodies, strict=True)]),
        columns_at=begins([len(body.columns) for body in bodies]),
        below=np.concatenate([body.below.ravel() for body in bodies]),
        below_at=begins([body.below.size for body in bodies]),
    )


def _in_voxels(lengths: np.ndarray, voxel: float) -> np.ndarray:
    return np.maximum(np.ceil(lengths / voxel - TUNING.rounded_off).astype(int), 1)
