"""Packing density, Eq. 6: from mesh volumes, and from voxel volumes counted with open3d."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import ndimage

from .geometry.containers import Container
from .geometry.meshes import Body
from .util import o3d
from .util.errors import InputError

VOXEL = 0.002  # metres, for objects of some centimetres
NUDGE = 1e-3  # of a voxel


def mesh_density(bodies: Sequence[Body], container: Container) -> float:
    """Eq. 6 from mesh volumes: `rho = sum |O_i| / |C|`, dimensionless."""
    return sum(body.volume for body in bodies) / container.volume


def voxel_density(bodies: Sequence[Body], matrices: np.ndarray, container: Container, voxel: float = VOXEL) -> float:
    """Eq. 6 from voxels of edge `voxel` metres, dimensionless.

    bodies placed by `matrices` `(N, 4, 4)` (file coordinates to world). Each body's surface is voxelised by open3d's
    VoxelGrid and its interior filled; a voxel that the surface runs through counts by the fraction of its eight
    octants' centres that lie inside. No voxel counts more than once, so that overlap lowers this density and not the
    mesh's. Raises InputError where voxel is not positive.
    """
    if not voxel > 0:
        raise InputError(f"the voxel's edge must be positive, got {voxel}")
    low, high = (float(edge) for edge in (container.bounds.min(), container.bounds.max()))
    count = int(np.ceil((high - low) / voxel)) + 2
    filled = np.zeros((count, count, count), np.float32)
    for body, matrix in zip(bodies, matrices, strict=True):
        start, part = _fill(body, matrix, np.full(3, low - voxel), voxel)
        where = tuple(slice(max(0, s), max(0, min(count, s + n))) for s, n in zip(start, part.shape, strict=True))
        inner = tuple(slice(w.start - s, w.stop - s) for w, s in zip(where, start, strict=True))
        filled[where] += part[inner]
    return float(np.minimum(filled, 1).sum(dtype=np.float64) * voxel**3 / container.volume)


def _fill(body: Body, matrix: np.ndarray, origin: np.ndarray, voxel: float) -> tuple[np.ndarray, np.ndarray]:
    """The body on the lattice of voxels from `origin`: its first voxel's index, and how much of each is inside."""
    open3d = o3d.load()
    vertices = body.placed(matrix)
    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(vertices), open3d.utility.Vector3iVector(body.solid_faces)
    )
    first = np.floor((vertices.min(0) - origin) / voxel).astype(int)
    shape = np.floor((vertices.max(0) - origin) / voxel).astype(int) - first + 1
    low = origin + first * voxel
    grid = open3d.geometry.VoxelGrid.create_from_triangle_mesh_within_bounds(mesh, voxel, low, low + shape * voxel)

    if not grid.get_voxels():  # faces between two voxels are in neither: a block that fills a box exactly
        moved = np.array(matrix, np.float64)
        moved[:3, 3] += NUDGE * voxel
        return _fill(body, moved, origin, voxel)
    shell = np.array([v.grid_index for v in grid.get_voxels()]).reshape(-1, 3)
    shell = shell[((shell >= 0) & (shell < shape)).all(1)]
    free = np.ones(shape, bool)
    free[tuple(shell.T)] = False

    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(open3d.t.geometry.TriangleMesh.from_legacy(mesh))

    def occupied(index: np.ndarray, rays: int) -> np.ndarray:
        """1 inside, 0 outside, at places given in voxels; most of an odd number of rays decide."""
        places = (low + voxel * index).astype(np.float32)
        return scene.compute_occupancy(open3d.core.Tensor(places), nsamples=rays).numpy()

    # the surface parts the other voxels into regions, each of them wholly inside or wholly outside
    region, regions = ndimage.label(free)
    spots = np.array(ndimage.maximum_position(free, region, np.arange(1, regions + 1))).reshape(-1, 3)
    filled = np.concatenate([[0], occupied(spots + 0.5, 3)])[region].astype(np.float32)
    octants = np.array(list(np.ndindex(2, 2, 2))) / 2 + 0.25
    filled[tuple(shell.T)] = occupied(shell[:, None] + octants, 1).mean(1)
    return first, filled
