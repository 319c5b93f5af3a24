"""Exact signed distances to a body's surface, and their directions: no grid, so that thin and sharp parts count.

open3d finds the nearest point of the surface, and counts how often a ray crosses it. The parity is wrong for some
points that lie in a plane with a face. The surface's normal at the nearest point says the side, too, on edges and
corners the mean one by angle (Baerentzen & Aanaes 2005, Signed distance computation using the angle weighted
pseudonormal); it is wrong where faces are needles. Where the two differ, the winding number decides.
"""

from __future__ import annotations

import numpy as np
import trimesh

from ..geometry.meshes import Body
from ..util import o3d

ON_EDGE = 1e-4  # barycentric coordinate below which the nearest point is on an edge or a corner
TINY = 1e-300
TOUCHING = 1e-5  # of the body's radius, below which the distance has no direction of its own
NODES = 24  # along the longest edge of the body's box, whose distances say which points may be near


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
        self._low = self._vertices.min(0)
        self._spacing = float(np.ptp(self._vertices, axis=0).max()) / (NODES - 1)
        nodes = np.ceil(np.ptp(self._vertices, axis=0) / self._spacing - 1e-6).astype(int) + 1
        self._at_nodes = self.at(self._low + self._spacing * np.stack(np.indices(nodes), -1).reshape(-1, 3))[0]
        self._at_nodes = self._at_nodes.reshape(nodes)

    def maybe_within(self, points: np.ndarray, reach: float) -> np.ndarray:
        """Of points `(M, 3)` those, `(M,)` bool, that may be no farther than a reach; all that are so near among them.

        A distance changes by no more than the way from the nearest node of a lattice.
        """
        last = np.array(self._at_nodes.shape) - 1
        node = np.minimum(np.maximum(np.rint((points - self._low) / self._spacing).astype(int), 0), last)
        way = np.linalg.norm(self._low + self._spacing * node - points, axis=1)
        return self._at_nodes[tuple(node.T)] - way <= reach

    def at(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of points `(M, 3)`: distances `(M,)`, negative inside, and unit directions `(M, 3)` in which they grow."""
        asked = points.astype(np.float32)
        found = self._scene.compute_closest_points(asked)
        away, normals = points - found["points"].numpy(), self._normals(found)
        length = np.linalg.norm(away, axis=1)
        inside = (away * normals).sum(1) < 0
        doubtful = np.flatnonzero(inside != (self._scene.compute_occupancy(asked).numpy() > 0))
        if len(doubtful):
            import igl

            inside[doubtful] = igl.winding_number(self._vertices, self._faces, points[doubtful]) > 0.5
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
