"""Convex pieces that stand for a body where contact is simulated: exact, so that what rests on them rests on the body.

A body's own pieces if all are convex; else its skin, a prism behind each face. Approximate decompositions, such as
CoACD's, fill hollows: what then rests in a bowl hangs in the air, by another height with every turn of the bowl.
"""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial import QhullError

from ..geometry.meshes import Body
from ..util import o3d

HULL_VOLUME_OF_CONVEX = 1.001  # a piece whose hull has at most so many times its volume is convex
FLAT_VOLUME_OF_CUBE = 1e-6  # a hull of less than this of its longest edge cubed is no solid
SKIN = 0.02  # of a body's longest edge: how thick its skin is, or
SKIN_OF_WALL = 0.45  # of the way to the other side, if that is less
MOST_FACES = 1000  # of a skin; finer surfaces are simplified


def convex_pieces(body: Body) -> list[np.ndarray]:
    """Corners `(V, 3)` of each piece's convex hull, about the body's centre, metres."""
    mesh = trimesh.Trimesh(body.vertices - body.centre, body.faces, process=False)
    pieces = mesh.split(only_watertight=False)
    hulls = [hull for piece in pieces if (hull := hull_of(piece.vertices[np.unique(piece.faces)])) is not None]
    volume = sum(abs(piece.volume) for piece in pieces)
    if sum(hull.volume for hull in hulls) <= HULL_VOLUME_OF_CONVEX * volume:
        return [np.asarray(hull.vertices) for hull in hulls]
    surface = simplified(body.solid_vertices, body.solid_faces, MOST_FACES)
    most = SKIN * 2 * float(body.half_extents.max())
    return prisms(surface, np.minimum(most, SKIN_OF_WALL * _behind(surface)))


def simplified(vertices: np.ndarray, faces: np.ndarray, most: int) -> trimesh.Trimesh:
    """A closed surface `(V, 3)`, `(F, 3)` with at most so many faces."""
    if len(faces) <= most:
        return trimesh.Trimesh(vertices, faces, process=False)
    open3d = o3d.load()
    fine = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(vertices), open3d.utility.Vector3iVector(np.asarray(faces, np.int32))
    )
    coarse = fine.simplify_quadric_decimation(most)
    return trimesh.Trimesh(np.asarray(coarse.vertices), np.asarray(coarse.triangles), process=False)


def prisms(surface: trimesh.Trimesh, depth: float | np.ndarray) -> list[np.ndarray]:
    """`(6, 3)` corners of a prism behind each face of a surface, or before it where depth, metres, of all its vertices
    or `(V,)`, is negative; those that span no volume are left out."""
    front = surface.vertices[surface.faces]
    inner = surface.vertices - surface.vertex_normals * np.broadcast_to(depth, len(surface.vertices))[:, None]
    back = inner[surface.faces]
    corners = np.concatenate([front, back], 1)
    across = np.abs(((front - back).mean(1) * surface.face_normals).sum(1))
    solid = surface.area_faces * across > FLAT_VOLUME_OF_CUBE * np.ptp(corners, axis=1).max(1) ** 3
    return list(corners[solid])


def _behind(surface: trimesh.Trimesh) -> np.ndarray:
    """`(V,)` metres from the surface inwards to the other side: behind the middles of a vertex's faces, the least."""
    scene = o3d.caster([(surface.vertices, surface.faces)])
    far = o3d.depths(scene, surface.triangles_center, -surface.face_normals, 1e-6 * surface.scale)
    least = np.full(len(surface.vertices), np.inf)
    np.minimum.at(least, surface.faces, far[:, None])
    return least


def hull_of(points: np.ndarray) -> trimesh.Trimesh | None:
    """The convex hull of `(V, 3)` points; None if they span no volume."""
    try:
        hull = trimesh.PointCloud(points).convex_hull
    except QhullError:
        return None
    return hull if hull.volume > FLAT_VOLUME_OF_CUBE * float(np.ptp(points, axis=0).max()) ** 3 else None
