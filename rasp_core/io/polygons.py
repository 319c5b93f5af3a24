"""Faces of any number of corners -> triangles, concave ones without folds."""

from __future__ import annotations

import numpy as np

from ..util.errors import MeshError

CURVED = 1e-4  # how much less the area of one cut must be than that of the other for a quad not to be flat


def triangulated(vertices: np.ndarray, counts: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Triangles `(F, 3)` int64 of polygons, n - 2 of each, in their order and winding.

    vertices : `(V, 3)`. counts : `(P,)`, corners of each polygon; those of fewer than three give no triangle.
    corners : `(sum of counts,)`, their vertices one after the other.
    Raises MeshError where a corner names a vertex that is not there.
    """
    counts, corners = np.asarray(counts, np.int64), np.asarray(corners, np.int64)
    if len(corners) and (corners.min() < 0 or corners.max() >= len(vertices)):
        raise MeshError("faces name vertices that are not there; export the mesh again")
    start = np.cumsum(counts) - counts
    made = np.maximum(counts - 2, 0)
    first = np.cumsum(made) - made
    faces = np.empty((int(made.sum()), 3), np.int64)
    for n in np.unique(counts[counts > 2]):
        which = np.flatnonzero(counts == n)
        polygons = corners[start[which, None] + np.arange(n)]
        faces[first[which, None] + np.arange(n - 2)] = _cut(vertices, polygons)
    return faces


def told_triangles(vertices: np.ndarray, counts: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """As `triangulated`, with a note on faces of fewer than three corners. Raises MeshError also if nothing is left."""
    faces = triangulated(vertices, counts, corners)
    if not len(faces):
        raise MeshError("holds no triangles; export it as a triangle mesh")
    few = int((np.asarray(counts) < 3).sum())
    return faces, (f"{few} faces of fewer than three corners are left out",) if few else ()


def _cut(vertices: np.ndarray, polygons: np.ndarray) -> np.ndarray:
    """Triangles `(P, n - 2, 3)` of polygons `(P, n)`: a fan where that is right, else ears are clipped."""
    n = polygons.shape[1]
    if n == 3:
        return polygons[:, None]
    with np.errstate(all="ignore"):  # corners that are not finite stay so, and are refused later
        points = vertices[polygons]
        points = points - points.mean(1, keepdims=True)
        normals = np.cross(points, np.roll(points, -1, 1)).sum(1)
        fan = np.stack([np.zeros(n - 2, np.int64), np.arange(1, n - 1), np.arange(2, n)], -1)
        fans = [fan] if n > 4 else [fan, (fan + 1) % 4]
        least = [np.einsum("pkd,pd->pk", _crossed(points, corners), normals).min(1) for corners in fans]
    faces = polygons[:, fan]
    bad = ~(least[0] > 0)
    if n == 4:  # of a quad's two diagonals the other one, if the first lies outside, or if it is not flat
        with np.errstate(all="ignore"):
            area = [np.linalg.norm(_crossed(points, corners), axis=-1).sum(1) for corners in fans]
            other = np.where(bad, least[1] > least[0], (least[1] > 0) & (area[1] < (1 - CURVED) * area[0]))
        faces[other] = polygons[other][:, fans[1]]
        return faces
    for k in np.flatnonzero(bad):
        ears = _ears(points[k], normals[k])
        if ears is not None:
            faces[k] = polygons[k][ears]
    return faces


def _crossed(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Twice the areas `(P, F, 3)` of triangles `(F, 3)` of each polygon `(P, n, 3)`, as vectors along their normals."""
    first, second, third = (points[:, corners[:, k]] for k in range(3))
    return np.cross(second - first, third - first)


def _ears(points: np.ndarray, normal: np.ndarray) -> np.ndarray | None:
    """Triangles `(n - 2, 3)` of one polygon `(n, 3)` seen along its normal, None where it cannot be cut so."""
    import manifold3d

    length = np.linalg.norm(normal)
    if not (length > 0 and np.isfinite(points).all()):
        return None
    normal = normal / length
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    across /= np.linalg.norm(across)
    flat = np.stack([points @ across, points @ np.cross(normal, across)], 1)
    ears = np.asarray(manifold3d.triangulate([flat / np.abs(flat).max()]), np.int64)
    whole = len(ears) == len(points) - 2 and len(np.unique(ears)) == len(points)
    return ears if whole else None
