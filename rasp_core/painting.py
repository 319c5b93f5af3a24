"""Colours for a heap, such that each view's picture of it is the one that was asked for.

Each pixel of a view sees one point of one triangle, found by a ray; its colour is the mean of the triangle's three
vertex colours by their barycentric weights. All pixels of all views are one sparse linear system in the colours of
finely divided vertices; the least squares solution that also is smooth along the surfaces (a Laplacian, lightly
weighted) settles what views dispute, and carries colours on to what no view sees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import cg

from . import o3d
from .cameras import Camera
from .meshes import Body

FINE = 2.0  # pixels between vertices
SMOOTH = 1e-2  # weight of the Laplacian against a pixel


@dataclass(frozen=True)
class Painted:
    """A heap's surfaces in its bodies' file frames, one after the other, and their colours.

    vertices `(V, 3)`, faces `(F, 3)`, colours `(V, 3)` in [0, 1]; first_vertex and first_face `(N + 1,)`: where each
    body's begin.
    """

    vertices: np.ndarray
    faces: np.ndarray
    colours: np.ndarray
    first_vertex: np.ndarray
    first_face: np.ndarray


class Seen:
    """What each pixel sees. pixel `(P,)` flat into `(K, H, W)`; corners `(P, 3)` vertices; weights `(P, 3)`."""

    def __init__(self, vertices, faces, cameras: Sequence[Camera], size: int):
        open3d = o3d.load()
        caster = open3d.t.geometry.RaycastingScene()
        caster.add_triangles(open3d.core.Tensor(vertices.astype(np.float32)), open3d.core.Tensor(faces.astype(np.uint32)))
        pixel, corners, weights = [], [], []
        for k, camera in enumerate(cameras):
            origins, directions = camera.rays(size)
            rays = np.concatenate([origins, directions], -1).astype(np.float32).reshape(-1, 6)
            hit = caster.cast_rays(open3d.core.Tensor(rays))
            face = hit["primitive_ids"].numpy()
            seen = np.flatnonzero(np.isfinite(hit["t_hit"].numpy()))
            uv = hit["primitive_uvs"].numpy()[seen]
            pixel.append(seen + k * size * size)
            corners.append(faces[face[seen]])
            weights.append(np.column_stack([1 - uv.sum(1), uv]))
        self.pixel, self.corners, self.weights = (np.concatenate(x) for x in (pixel, corners, weights))
