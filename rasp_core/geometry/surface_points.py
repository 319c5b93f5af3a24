"""Points spread over a surface at random."""

from __future__ import annotations

import numpy as np
import trimesh


def surface_points(vertices: np.ndarray, faces: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points `(count, 3)` spread at random over a surface, as dense everywhere, and their unit normals `(count, 3)`.

    vertices `(V, 3)`, faces `(F, 3)`. The same surface and count give the same points.
    """
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    points, face = trimesh.sample.sample_surface(mesh, count, seed=0)
    return np.asarray(points), np.asarray(mesh.face_normals[face])
