"""Exact signed distances to a body's surface, and their directions: no grid, so that thin and sharp parts count.

open3d finds the nearest point of the surface, and counts how often a ray crosses it. The parity is wrong for some
points that lie in a plane with a face. The surface's normal at the nearest point says the side, too, on edges and
corners the mean one by angle (Baerentzen & Aanaes 2005, Signed distance computation using the angle weighted
pseudonormal); it is wrong where faces are needles. Where the two differ, the winding number decides.
"""

from __future__ import annotations

import numpy as np
import trimesh

from ..util import o3d
from .meshes import Body

ON_EDGE = 1e-4  # barycentric coordinate below which the nearest point is on an edge or a corner
TINY = 1e-300
TOUCHING = 1e-5  # of the body's radius, below which the distance has no direction of its own


class MeshDistance:
    """Of one body, in the frame about its centre; metres."""

    def __init__(self, body: Body) -> None:
        self._vertices, self._faces = body.solid_vertices, body.solid_faces
        self._scene = o3d.caster([(self._vertices, self._faces)])
        mesh = trimesh.Trimesh(self._vertices, self._faces, process=False)
        self._corner_normals = np.asarray(mesh.vertex_normals)
        crosses = np.asarray(mesh.triangles_cross)
        self._face_normals = crosses / np.linalg.norm(crosses, axis=1, keepdims=True).clip(TINY)
        self._edge_normals = np.repeat(self._face_normals[:, None], 3, 1)  # of the edge opposite to each corner
        pairs, across = mesh.face_adjacency, self._face_normals[mesh.face_adjacency].sum(1)
        for faces in pairs.T:
            on_edge = (self._faces[faces][:, :, None] == mesh.face_adjacency_edges[:, None]).any(2)
            self._edge_normals[faces, on_edge.argmin(1)] = across
        self._touching = TOUCHING * body.radius

    def at(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of points `(M, 3)`: distances `(M,)`, negative inside, and unit directions `(M, 3)` in which they grow."""
        asked = points.astype(np.float32)
        found = self._scene.compute_closest_points(asked)
        away, normals = points - found["points"].numpy(), self._normals(found)
        length = np.linalg.norm(away, axis=1)
        inside = (away * normals).sum(1) < 0
        doubtful = np.flatnonzero(inside != (self._scene.compute_occupancy(asked).numpy() > 0))
        inside[doubtful] = winding_numbers(self._vertices, self._faces, points[doubtful]) > 0.5
        side = np.where(inside, -1.0, 1.0)
        directions = normals / np.linalg.norm(normals, axis=1, keepdims=True).clip(TINY)
        far = length > self._touching
        directions[far] = side[far, None] * away[far] / length[far, None]
        return side * length, directions

    def _normals(self, found: dict) -> np.ndarray:
        """`(M, 3)`, of the surface at the nearest points, of some length."""
        face, uv = found["primitive_ids"].numpy(), found["primitive_uvs"].numpy()
        near = np.column_stack([1 - uv.sum(1), uv]) < ON_EDGE
        normals, on = self._face_normals[face], near.sum(1)
        edge, corner = np.flatnonzero(on == 1), np.flatnonzero(on == 2)
        normals[edge] = self._edge_normals[face[edge], near[edge].argmax(1)]
        normals[corner] = self._corner_normals[self._faces[face[corner], near[corner].argmin(1)]]
        return normals


def winding_numbers(vertices: np.ndarray, faces: np.ndarray, points: np.ndarray) -> np.ndarray:
    """How often a closed surface, `(V, 3)` and `(F, 3)`, goes round points `(M, 3)`: 1 inside, 0 outside.

    The sum of the faces' solid angles over 4 pi (van Oosterom & Strackee 1983)."""
    found = np.empty(len(points))
    for k, point in enumerate(points):
        a, b, c = (vertices[faces[:, corner]] - point for corner in range(3))
        far = [np.linalg.norm(arm, axis=1) for arm in (a, b, c)]
        volume = (a * np.cross(b, c)).sum(1)
        length = far[0] * far[1] * far[2] + (a * b).sum(1) * far[2] + (b * c).sum(1) * far[0] + (c * a).sum(1) * far[1]
        found[k] = np.arctan2(volume, length).sum() / (2 * np.pi)
    return found
