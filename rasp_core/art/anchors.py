"""Points in solids where struts may end: deep enough that a joint is as thick as the strut."""

from __future__ import annotations

from collections.abc import Sequence

import manifold3d
import numpy as np

from ..geometry.surface_points import surface_points
from ..util import o3d

ANCHORS = 300  # points of a solid


def inner_points(solids: Sequence[manifold3d.Manifold], radius: float) -> tuple[list[np.ndarray], np.ndarray]:
    """For each solid points `(A, 3)` in it, as deep as a strut's radius or in the middle of thinner walls; and for all
    of them in a row how thick the walls are."""
    surfaces, starts, inward = [], [], []
    for solid in solids:
        mesh = solid.to_mesh64()
        vertices, faces = np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, np.int64)
        points, normals = surface_points(vertices, faces, ANCHORS)
        surfaces.append((vertices, faces))
        starts.append(points)
        inward.append(-normals)
    points, inward = np.concatenate(starts), np.concatenate(inward)
    size = float(np.ptp(points, axis=0).max())
    skin = 1e-5 * size
    depth = skin + o3d.depths(o3d.caster(surfaces), points, inward, skin)
    inner = points + np.minimum(depth / 2, radius)[:, None] * inward
    return np.split(inner, np.cumsum([len(x) for x in starts])[:-1]), depth


def base_points(low: np.ndarray, high: np.ndarray, z: float, radius: float, spacing: float) -> np.ndarray:
    """Points `(A, 3)` in the middle of a base, a strut's largest radius from its rim."""
    axes = [np.arange(low[k] + 2 * radius, high[k] - 2 * radius, spacing) for k in (0, 1)]
    flat = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2)
    return np.column_stack([flat, np.full(len(flat), z)])
