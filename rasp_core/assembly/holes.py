"""Where pieces are missing: borders of fractures that no other piece lies on, and the rough surface along them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from . import creases
from .crease_matching import Piece
from .scored_poses import ScoredPose

NEAR_SPACINGS = 2.5  # of points: nearer to another piece's surface, a point is covered
LINK_SPACINGS = 4.0  # points of a border, or of a face, that are nearer belong together
ALONG_SPACINGS = 6.0  # surface so near to the border belongs to the hole
LEAST_SHARE = 0.1  # of all such points: a shorter border is none of a hole
LEAST_POINTS = 12


@dataclass(frozen=True)
class Hole:
    """A connected patch of fracture that nothing lies on. centre `(3,)` metres, in the world; area in square metres."""

    centre: np.ndarray
    area: float

    def to_dict(self) -> dict:
        """As plain numbers, for `result.json`."""
        return {"centre": self.centre.tolist(), "area": self.area}


def find_holes(pieces: Sequence[Piece], poses: Sequence[ScoredPose]) -> list[Hole]:
    """The holes that placed pieces leave, the largest first. The area is of rough surface near the hole's border, all
    of it on a thin wall. Smooth fractures are not seen."""
    spacing = pieces[0].spacing
    near = NEAR_SPACINGS * spacing
    trees = [cKDTree(p.points @ q.rotation.T + q.translation) for p, q in zip(pieces, poses, strict=True)]

    def bare(k: int, points: np.ndarray) -> np.ndarray:
        """Those of a piece's points that no other piece is near to, in the world."""
        points = points @ poses[k].rotation.T + poses[k].translation
        others = [tree.query(points, distance_upper_bound=near)[0] for j, tree in enumerate(trees) if j != k]
        return points[np.isinf(others).all(0)]

    broken = [piece.creases.points[piece.broken] for piece in pieces]
    border = np.concatenate([bare(k, points) for k, points in enumerate(broken)])
    if not len(border):
        return []
    surface = np.concatenate([bare(k, _fractured(piece)) for k, piece in enumerate(pieces)])
    pairs = cKDTree(border).query_pairs(LINK_SPACINGS * spacing, output_type="ndarray")
    links = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(len(border),) * 2)
    _, patch = connected_components(links, directed=False)
    least = max(LEAST_POINTS, LEAST_SHARE * sum(map(len, broken)))
    found = []
    for k in np.flatnonzero(np.bincount(patch) > least):
        away = cKDTree(border[patch == k]).query(surface)[0] if len(surface) else np.zeros(0)
        area = float((away < ALONG_SPACINGS * spacing).sum() * spacing**2)
        found.append(Hole(border[patch == k].mean(0), area))
    return sorted(found, key=lambda hole: -hole.area)


def _fractured(piece: Piece) -> np.ndarray:
    """Points on rough surface, and near it on the same face: along its border a face is not seen to be rough."""
    if not len(piece.rough):
        return np.zeros((0, 3))
    away, nearest = cKDTree(piece.points[piece.rough]).query(piece.points)
    cosine = (piece.normals * piece.normals[piece.rough[nearest]]).sum(1)
    return piece.points[(away < LINK_SPACINGS * piece.spacing) & (cosine > creases.SETTINGS.rough_cosine)]
