"""Poses of a piece beside others, by their creases: the border of a fracture is there on both sides of it.

One crease point of the piece laid on one of the others, broken face against broken face and the unbroken ones in one
sheet, is a whole pose. All such poses are tried; the best by how much of both creases then coincides are drawn in, by
the closed form of the best rigid motion, and judged anew, less what the piece then has within the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import torch
from scipy.spatial.transform import Rotation

from ..geometry import sdf
from ..geometry.meshes import Body
from ..geometry.surface_points import surface_points
from ..kernels.creases import Creases
from . import creases as finding
from .scored_poses import ScoredPose, best_first, distinct, stack, unstack


@dataclass(frozen=True)
class Round:
    """Of a search: the best poses, `kept` at most, of which no two are nearer than apart_rad and apart_spacings, are
    drawn in by `steps`; reach, in spacings of points, and the least cosine between normals, of crease points that
    match; points : of the piece that are looked at, all if None."""

    kept: int
    steps: int
    reach: float
    cosine: float
    points: int | None = None
    apart_rad: float = 0.1
    apart_spacings: float = 2.0


@dataclass(frozen=True)
class MatchingSettings:
    """points : spread over all pieces, or piece_points for each piece if that is more; their spacing is the unit of
    length.

    rounds : of the search by creases, the first one with all poses. bend_rad : how far the bends of two creases may be
    from filling half a turn. tried : crease points of each side from which poses are made, at most. deep_spacings :
    from where a point of the piece is inside another; penalty : of such a point, in crease points; probes : points that
    are looked at for it, at most, and rough ones for contact. contact : how near, and with which cosine of normals, a
    rough point lies on another piece, and its weight, in crease points.

    strip_spacings : how far from a crease a face is looked at, to see whether it lies on another piece; a ledge is
    there if it does, the face beyond the crease does not, and no crease of another piece is within ledge_spacings.
    ledge, early_ledge : what each such point costs, in the end and while pieces may still close it. smooth_weight :
    what a crease point counts in an assembly that is not beside rough surface, as on a rim.

    returned, apart : how many poses, and how different they are. press : from where, at first and at last, and under
    which cosine of normals, surfaces are drawn to each other; damping and the largest turn of a step keep that from
    running away.
    """

    points: int = 16_000
    piece_points: int = 6_000
    rounds: tuple[Round, ...] = (
        Round(6000, 0, 4.0, 0.7, points=64, apart_rad=0.05, apart_spacings=1.0),
        Round(1000, 3, 4.0, 0.7),
        Round(300, 5, 3.0, 0.75),
        Round(120, 8, 2.0, 0.8),
    )
    bend_rad: float = 0.45
    tried: int = 200
    probes: int = 500
    deep_spacings: float = 1.0
    penalty: float = 0.1
    contact_spacings: float = 1.5
    contact_cosine: float = 0.8
    contact_weight: float = 0.15
    strip_spacings: float = 2.0
    ledge_spacings: float = 2.0
    smooth_weight: float = 0.6
    ledge: float = 1.5
    early_ledge: float = 0.3
    returned: int = 30
    apart_rad: float = 0.1
    apart_spacings: float = 4.0
    grid_cells: int = 64
    press_spacings: tuple[float, float] = (2.0, 0.7)
    press_steps: int = 8
    press_cosine: float = 0.6
    damping: float = 1e-4
    largest_turn_rad: float = 0.15


SETTINGS = MatchingSettings()


class Piece:
    """A body with points spread over its surface, their normals, its creases and its signed distance grid; all about
    the body's centre. rough : numbers of the points on rough surface; probes, rough_probes : some of all, and of those,
    by which it is judged in many poses. strips : see `creases.strips`. broken `(E,)` bool : crease points beside rough
    surface; weights `(E,)` : what they count in an assembly."""

    def __init__(self, body: Body, spacing: float):
        self.body, self.spacing = body, spacing
        count = max(int(body.manifold.surface_area() / spacing**2), 50)
        self.points, self.normals = surface_points(body.solid_vertices, body.solid_faces, count)
        self.creases = finding.find_creases(self.points, self.normals, spacing)
        self.strips = finding.strips(self.creases, SETTINGS.strip_spacings * spacing)
        self.rough = finding.rough_points(self.points, self.normals, spacing)
        self.broken = finding.beside(self.creases, self.points[self.rough], spacing)
        self.weights = np.where(self.broken, 1, SETTINGS.smooth_weight).astype(np.float32)
        self.probes, self.rough_probes = (
            np.random.default_rng(0).permutation(chosen)[: SETTINGS.probes]
            for chosen in (np.arange(len(self.points)), self.rough)
        )
        self.grid = sdf.bake_cached(body, SETTINGS.grid_cells)
        self.target = Target([self], [ScoredPose(np.eye(3), np.zeros(3))])


class Target:
    """Placed pieces, whose creases and solids a further piece meets."""

    def __init__(self, pieces: Sequence[Piece], poses: Sequence[ScoredPose]):
        reach = SETTINGS.rounds[0].reach * pieces[0].spacing
        self.creases = finding.joined(
            [finding.moved(p.creases, q.rotation, q.translation) for p, q in zip(pieces, poses, strict=True)]
        )
        self.lookup = finding.lookup(self.creases, reach, pieces[0].spacing)
        rotation, translation = stack(poses)
        self.solids = {
            "grids": sdf.GridStack([piece.grid for piece in pieces]).arrays,
            "half_extents": np.array([piece.body.half_extents for piece in pieces]).reshape(-1, 3),
            "radius": np.array([piece.body.radius for piece in pieces]),
            "rotation": rotation,
            "translation": translation,
        }


def spacing_of(bodies: Sequence[Body]) -> float:
    """Metres between points of which `SETTINGS.points` are spread over all bodies."""
    points = max(SETTINGS.points, SETTINGS.piece_points * len(bodies))
    return float(np.sqrt(sum(body.manifold.surface_area() for body in bodies) / points))


def find_poses(piece: Piece, target: Target, random: np.random.Generator) -> list[ScoredPose]:
    """Poses of a piece beside placed ones, the best first, no two the same. A score is the number of crease points that
    coincide, and of rough ones that touch, less a penalty for what lies within others."""
    from ..kernels.distinct import distinct as distinct_rows

    rotation, translation = _single_point_poses(piece.creases, target.creases, random)
    for step in SETTINGS.rounds:
        scores = matched(piece, target, rotation, translation, step)
        best = np.argsort(-scores, kind="stable")[: np.count_nonzero(scores)]
        rotation, translation = rotation[best], translation[best]
        gap = step.apart_spacings * piece.spacing
        fresh = distinct_rows(rotation, translation, np.cos(step.apart_rad), gap, step.kept)
        rotation, translation = rotation[fresh], translation[fresh]
        for _ in range(step.steps):
            rotation, translation = drawn_in(piece, target, rotation, translation, step)
    poses = best_first(scored(piece, target, unstack(rotation, translation, np.zeros(len(rotation)))))
    apart = SETTINGS.apart_spacings * piece.spacing
    return distinct([p for p in poses if p.score > 0], SETTINGS.returned, SETTINGS.apart_rad, apart)


def matched(piece: Piece, target: Target, rotation, translation, step: Round = SETTINGS.rounds[-1]) -> np.ndarray:
    """`(B,)`: crease points of the piece that lie on the target's, the nearer the more."""
    from ..kernels import creases

    # they are in random order
    moving = Creases(*(array[: step.points] for array in piece.creases))
    reach = step.reach * piece.spacing
    found = creases.matches(
        target.creases, target.lookup, moving, rotation, translation, reach=reach, cosine=step.cosine
    )
    return found.sum(1)


def drawn_in(piece: Piece, target: Target, rotation, translation, step: Round = SETTINGS.rounds[-1]):
    """Each pose after the rigid motion that brings matched crease points and their normals together (Kabsch)."""
    from ..kernels import creases

    reach = step.reach * piece.spacing
    sums = creases.moments(
        target.creases, target.lookup, piece.creases, rotation, translation, reach=reach, cosine=step.cosine
    )
    return _brought_together(sums, rotation, translation, reach)


def drawn_between(piece: Piece, pose: ScoredPose, placed: Sequence[tuple[Piece, ScoredPose]]) -> ScoredPose:
    """One pose after the same motion, between pieces each at its own pose."""
    from ..kernels import creases

    last = SETTINGS.rounds[-1]
    reach, total = last.reach * piece.spacing, None
    for other, there in placed:
        back = there.rotation.T
        shift = back @ (pose.translation - there.translation)
        if np.linalg.norm(shift) > piece.body.radius + other.body.radius:
            continue
        seen = (back @ pose.rotation)[None], shift[None]
        weight, rest, own, places, normals = creases.moments(
            other.creases, other.target.lookup, piece.creases, *seen, reach=reach, cosine=last.cosine
        )
        rest = rest @ back + weight[:, None] * there.translation
        places = there.rotation @ places + there.translation[:, None] * own[:, None, :]
        sums = (weight, rest, own, places, there.rotation @ normals)
        total = sums if total is None else tuple(one + more for one, more in zip(total, sums, strict=True))
    if total is None:
        return pose
    rotation, translation = _brought_together(total, pose.rotation[None], pose.translation[None], reach)
    return ScoredPose(rotation[0], translation[0], pose.score)


def _brought_together(sums, rotation, translation, reach: float):
    """The poses after the best rigid motions by the sums of `kernels.creases.moments`; few matches leave them."""
    weight, rest, own, places, normals = sums
    some = np.maximum(weight, 1e-9)[:, None]
    spread = places - rest[:, :, None] * own[:, None, :] / some[:, :, None]
    u, _, v = np.linalg.svd(spread + normals * (reach**2))
    sign = np.ones((len(weight), 3))
    sign[:, 2] = np.sign(np.linalg.det(u @ v))
    turned = (u * sign[:, None, :]) @ v
    shifted = rest / some - np.einsum("bij,bj->bi", turned, own / some)
    few = weight < 2
    return np.where(few[:, None, None], rotation, turned), np.where(few[:, None], translation, shifted)


def pressed(piece: Piece, target: Target, rotation, translation):
    """Each pose after steps of least squares, point to plane, of the piece's surface on the target's."""
    from ..kernels.point_to_plane import Contact, normal_equations

    damping = np.diag([SETTINGS.damping * piece.body.radius**2] * 3 + [SETTINGS.damping] * 3)
    for reach in np.linspace(*SETTINGS.press_spacings, SETTINGS.press_steps):
        contact = Contact(distance=reach * piece.spacing, cosine=SETTINGS.press_cosine)
        square, slope, rows = normal_equations(
            **_meeting(piece, target), rotation=rotation, translation=translation, contact=contact
        )
        square += damping * (1 + rows)[:, None, None]
        move = -np.linalg.solve(square, slope[:, :, None])[:, :, 0]
        angle = np.maximum(np.linalg.norm(move[:, :3], axis=1), 1e-12)
        move[:, :3] *= np.minimum(1, SETTINGS.largest_turn_rad / angle)[:, None]
        rotation, translation = Rotation.from_rotvec(move[:, :3]).as_matrix() @ rotation, translation + move[:, 3:]
    return rotation, translation


def scored(piece: Piece, target: Target, poses: Sequence[ScoredPose]) -> list[ScoredPose]:
    """The same poses with their scores."""
    if not len(poses):
        return []
    rotation, translation = stack(poses)
    scores = matched(piece, target, rotation, translation)
    scores += SETTINGS.contact_weight * touching(piece, target, rotation, translation)
    return unstack(rotation, translation, scores - SETTINGS.penalty * within(piece, target, rotation, translation))


def touching(piece: Piece, target: Target, rotation, translation) -> np.ndarray:
    """`(B,)`: how many of the piece's points on rough surface lie on the target's surface, the nearer the more."""
    from ..kernels.point_to_plane import Contact, coverage

    if not len(piece.rough):
        return np.zeros(len(rotation))
    distance = SETTINGS.contact_spacings * piece.spacing
    contact = Contact(distance=distance, cosine=SETTINGS.contact_cosine)
    covered, _ = coverage(
        **_meeting(piece, target, piece.rough_probes), rotation=rotation, translation=translation, contact=contact
    )
    return covered * len(piece.rough)


def within(piece: Piece, target: Target, rotation, translation) -> np.ndarray:
    """`(B,)`: how many of the piece's points lie within the target's solids."""
    from ..kernels.point_to_plane import Contact, coverage

    contact = Contact(distance=SETTINGS.deep_spacings * piece.spacing, cosine=1.0)
    _, outside = coverage(
        **_meeting(piece, target, piece.probes), rotation=rotation, translation=translation, contact=contact
    )
    return outside * len(piece.points)


def _meeting(piece: Piece, target: Target, chosen: np.ndarray | slice = slice(None)) -> dict:
    """What the compiled loops are given of a piece, of its points or of chosen ones, and of what it meets."""
    from ..kernels.point_to_plane import Placed, Surface, Whole

    return {
        "part": Surface(piece.points[chosen], piece.normals[chosen]),
        "whole": Whole(_endless(), matched=False),
        "placed": Placed(**target.solids),
        "skip": -1,
    }


@cache
def _endless() -> tuple:
    """A wall that nothing meets."""
    return np.full(3, 1e9), np.zeros(3), sdf.GridStack([], dtype=torch.float32).arrays


def _single_point_poses(own: Creases, others: Creases, random: np.random.Generator):
    """Rotations `(B, 3, 3)` and translations `(B, 3)` that lay one crease point on another."""
    sides = []
    for creases in (others, own):
        chosen = random.permutation(len(creases.points))[: SETTINGS.tried]
        points, first, second = (array[chosen] for array in creases)
        sides.append((np.concatenate([points] * 2), np.concatenate([first, second]), np.concatenate([second, first])))
    (there, broken, whole), (here, own_broken, own_whole) = sides
    bend = np.arccos(np.clip((broken * whole).sum(1), -1, 1))
    own_bend = np.arccos(np.clip((own_broken * own_whole).sum(1), -1, 1))
    i, j = np.nonzero(np.abs(bend[:, None] + own_bend[None] - np.pi) < SETTINGS.bend_rad)
    rotation = _frames(broken, whole)[i] @ _frames(-own_broken, own_whole)[j].swapaxes(1, 2)
    return rotation, there[i] - np.einsum("bij,bj->bi", rotation, here[j])


def _frames(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """`(B, 3, 3)` orthonormal columns, the first two in the plane of two unit vectors that are not parallel."""
    apart, middle = finding.unit(one - other), finding.unit(one + other)
    return np.stack([apart, middle, np.cross(apart, middle)], axis=2)
