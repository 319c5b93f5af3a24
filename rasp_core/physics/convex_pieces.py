"""Convex pieces that make up a body, as simulations of contact need them.

A body's own pieces if all are convex, else CoACD's (Wei et al. 2022, Approximate Convex Decomposition for 3D Meshes
with Collision-Aware Concavity and Tree Search), whose hulls cover the body and a little more.
"""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial import QhullError

from ..geometry.meshes import Body
from ..io.kept_arrays import kept

HULL_VOLUME_OF_CONVEX = 1.001  # a piece whose hull has at most so many times its volume is convex
FLAT_VOLUME_OF_CUBE = 1e-6  # a hull of less than this of its longest edge cubed is no solid
CONCAVITY = 0.05  # CoACD's threshold
COACD = {"preprocess_mode": "off", "mcts_iterations": 60, "mcts_max_depth": 2, "decimate": False}


def convex_pieces(body: Body) -> list[np.ndarray]:
    """Corners `(V, 3)` of each piece's convex hull, about the body's centre, metres."""
    mesh = trimesh.Trimesh(body.vertices - body.centre, body.faces, process=False)
    pieces = mesh.split(only_watertight=False)
    hulls = [hull for piece in pieces if (hull := hull_of(piece.vertices[np.unique(piece.faces)])) is not None]
    volume = sum(abs(piece.volume) for piece in pieces)
    if sum(hull.volume for hull in hulls) <= HULL_VOLUME_OF_CONVEX * volume:
        return [np.asarray(hull.vertices) for hull in hulls]
    found = kept("convex_pieces", f"{body.digest} {CONCAVITY} {COACD}", lambda: _decomposed(body))
    return [found[name] for name in sorted(found)]


def _decomposed(body: Body) -> dict[str, np.ndarray]:
    import coacd

    coacd.set_log_level("error")
    mesh = coacd.Mesh(body.solid_vertices, body.solid_faces.astype(np.int32))
    found = [np.asarray(vertices) for vertices, _ in coacd.run_coacd(mesh, threshold=CONCAVITY, **COACD)]
    return {f"{k:06d}": corners for k, corners in enumerate(found) if hull_of(corners) is not None}


def hull_of(points: np.ndarray) -> trimesh.Trimesh | None:
    """The convex hull of `(V, 3)` points; None if they span no volume."""
    try:
        hull = trimesh.PointCloud(points).convex_hull
    except QhullError:
        return None
    return hull if hull.volume > FLAT_VOLUME_OF_CUBE * float(np.ptp(points, axis=0).max()) ** 3 else None
