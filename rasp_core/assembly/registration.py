"""Where a part of a broken thing belongs in what is still free of the whole.

A part's surface lies on the boundary of the free room wherever it was surface of the whole, or is a fracture whose
other side has its place already. Poses come from pairs of points that are alike on the part and on that boundary
(`matching`); those under which most of the part's surface lies on it are drawn in by least squares on signed distances,
point to plane (Chen & Medioni 1992), and judged. The paper's signal is the silhouettes; this one is the kit's.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
import trimesh
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from ..geometry import sdf
from ..geometry.containers import Container
from ..geometry.meshes import Body
from .point_pair_features import poses

FINE, FINEST = 44, 80  # lengths that the whole's longest edge is divided into: near is so much; for small parts
SMALL = 0.17  # of that edge: radius of a small part
WHOLE_POINTS = 4000  # of the whole's surface
POINTS = 600  # of a part's surface
SCREENS = (30, 3000, 3.0), (100, 400, 2.0)  # points by which poses are judged, poses kept, times CLOSE
DRAWN = 60  # places of those that are drawn in
FOUND = 20  # of which are told
STEPS = 20  # of least squares
NEAR = 3.0  # fine lengths from which a surface is drawn to a boundary, at first
CLOSE = 0.35  # fine lengths within which it counts as lying there, the more the nearer
ALIKE = 0.6  # least cosine between normals that are drawn together
OUTSIDE = 2.0  # what surface outside of the room costs, against surface on its boundary


@dataclass(frozen=True)
class Place:
    """A pose of a part: rotation `(3, 3)`, its centre's place `(3,)`; score, the larger the better, under 1."""

    rotation: np.ndarray
    centre: np.ndarray
    score: float

    def far_from(self, other: Place, angle: float, reach: float) -> bool:
        """Whether they differ by more than an angle (radians), or a distance (metres)."""
        turned = (np.trace(self.rotation.T @ other.rotation) - 1) / 2
        return np.arccos(np.clip(turned, -1, 1)) > angle or np.linalg.norm(self.centre - other.centre) > reach


class Part:
    """A body with its signed distance grid, and points `(P, 3)` on its surface with their normals, in its frame."""

    def __init__(self, body: Body):
        self.body, self.grid = body, sdf.bake_cached(body)
        self.points, self.normals = _surface(body, POINTS)
        self.area = body.manifold.surface_area()
        self._stack = sdf.GridStack([self.grid])

    def signed_distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance and its gradient at points `(M, 3)` of the body's frame."""
        first = torch.zeros(len(points), dtype=torch.int64)
        value, gradient = self._stack.sample(first, torch.from_numpy(points).float())
        return value.numpy().astype(np.float64), gradient.numpy().astype(np.float64)


class Docking:
    """The whole, and the parts that have their places in it. attracts : False where the whole's surface is only a
    bound, and does not draw parts to it.

    boundary, normals `(M, 3)`, owner `(M,)` : points of the whole's surface (owner -1) and of placed parts' fractures
    (by their number) that nothing covers, and the normals that a part's surface there must have.
    """

    def __init__(self, whole: Container, attracts: bool = True):
        edge = float(np.ptp(whole.bounds, axis=0).max())
        self.whole, self.attracts = whole, attracts
        self.fine, self.finest, self.small = edge / FINE, edge / FINEST, SMALL * edge
        self.placed: list[tuple[Part, Place]] = []
        self.wall = whole.arrays(torch.float32)
        self._note_placed()
        points, self.normals = _surface(whole.body, WHOLE_POINTS)
        self.boundary = points + whole.body.centre
        self.surface, self.outwards = cKDTree(self.boundary), self.normals
        self.owner = np.full(len(points), -1)

    def put(self, part: Part, place: Place) -> None:
        """Give a part its place."""
        free = ~self._covered(part, place, self.boundary)
        points, normals = part.points @ place.rotation.T + place.centre, part.normals @ place.rotation.T
        away, nearest = self.surface.query(points)
        along = (normals * self.outwards[nearest]).sum(1)
        depth = -self.whole.signed_distance(torch.from_numpy(points).float())[0].numpy()
        bare = (depth > CLOSE * self.fine / 2) & ((along < ALIKE) | (away > 2 * self.fine))
        for other, there in self.placed:
            bare &= ~self._covered(other, there, points)
        self.owner = np.append(self.owner[free], np.full(bare.sum(), len(self.placed)))
        self.boundary = np.concatenate([self.boundary[free], points[bare]])
        self.normals = np.concatenate([self.normals[free], -normals[bare]])
        self.placed.append((part, place))
        self._note_placed()

    def move(self, number: int, place: Place) -> None:
        """Give the placed part of that number another place nearby; the boundary is not looked at anew."""
        self.placed[number] = self.placed[number][0], place

    def copy(self) -> Docking:
        """The same state, to go on from in another way."""
        twin = copy.copy(self)
        twin.placed = list(self.placed)
        return twin

    def places(self, part: Part, random: np.random.Generator, about: int | None = None) -> list[Place]:
        """Places for a part, the best first, no two of them alike; empty where it fits nowhere.

        about : only those that touch this one of the placed parts.
        """
        fracture = np.flatnonzero(self.owner >= 0 if about is None else self.owner == about)
        references = fracture
        if about is None:
            outer = random.permutation(np.flatnonzero(self.owner < 0))
            references = np.append(fracture, outer[: max(len(fracture), len(outer) // 8)])
        if not len(references):
            return []
        surfaces = (part.points, part.normals), (self.boundary, self.normals)
        rotation, centre = poses(*surfaces, references, 2 * part.body.radius, random)
        for count, kept, loose in SCREENS:
            scores = self._scores(part, rotation, centre, count, loose)
            best = np.argsort(-scores, kind="stable")[:kept]
            rotation, centre, scores = rotation[best], centre[best], scores[best]
        likely = apart(_places(rotation, centre, scores), DRAWN, 0.12, 0.1 * part.body.radius)
        drawn = [place for place in self.draw_in(part, likely) if place.score > 0] if likely else []
        return apart(sorted(drawn, key=cost), FOUND, 0.1, 0.1 * part.body.radius)

    def draw_in(self, part: Part, places: Sequence[Place]) -> list[Place]:
        """Near each place the one where most of the part's surface lies on the room's boundary, with its score."""
        from ..kernels import point_to_plane

        rotation, centre = _poses(places)
        fine = self.finest if part.body.radius < self.small else self.fine
        damping = np.diag([1e-4 * part.body.radius**2] * 3 + [1e-4] * 3)
        for step in range(STEPS):
            near = fine * (NEAR * (1 - step / STEPS) + CLOSE / 2)
            square, slope, rows = point_to_plane.normal_equations(
                **self._surfaces(part),
                rotation=rotation,
                translation=centre,
                contact=point_to_plane.Contact(distance=near, cosine=ALIKE),
            )
            square += damping * (1 + rows)[:, None, None]
            turn = -np.linalg.solve(square, slope[:, :, None])[:, :, 0]
            turn[:, :3] *= np.minimum(1, 0.15 / np.maximum(np.linalg.norm(turn[:, :3], axis=1), 1e-12))[:, None]
            rotation = Rotation.from_rotvec(turn[:, :3]).as_matrix() @ rotation
            centre = centre + turn[:, 3:]
        return _places(rotation, centre, self._scores(part, rotation, centre))

    def score(self, part: Part, place: Place) -> float:
        """How much of the part's surface lies on the room's boundary, less twice the share that leaves the room."""
        return self.rescored(part, [place])[0].score

    def rescored(self, part: Part, places: Sequence[Place]) -> list[Place]:
        """The same places with the scores that they have now."""
        rotation, centre = _poses(places)
        return _places(rotation, centre, self._scores(part, rotation, centre))

    def _scores(self, part: Part, rotation, centre, count: int = POINTS, loose: float = 1.0) -> np.ndarray:
        """By the first `count` of the part's points; loose : what counts as close, times CLOSE."""
        from ..kernels import point_to_plane

        covered, outside = point_to_plane.coverage(
            **self._surfaces(part, count),
            rotation=rotation,
            translation=centre,
            contact=point_to_plane.Contact(distance=loose * CLOSE * self.fine, cosine=0.75),
        )
        return covered - OUTSIDE * outside

    def _surfaces(self, part: Part, count: int = POINTS) -> dict:
        """What the compiled loops are given of the part and of what it meets."""
        from ..kernels.point_to_plane import Placed, Surface, Whole

        rotation, centre = _poses([place for _, place in self.placed])
        return {
            "part": Surface(part.points[:count], part.normals[:count]),
            "whole": Whole(self.wall, self.attracts),
            "placed": Placed(*self._solids, rotation, centre),
            "skip": next((k for k, (other, _) in enumerate(self.placed) if other is part), -1),
        }

    def _note_placed(self) -> None:
        """Keep the placed parts' grids, boxes and radii as arrays."""
        parts = [part for part, _ in self.placed]
        self._solids = (
            sdf.GridStack([part.grid for part in parts]).arrays,
            np.array([part.body.half_extents for part in parts]).reshape(-1, 3),
            np.array([part.body.radius for part in parts]),
        )

    def _covered(self, part: Part, place: Place, points: np.ndarray) -> np.ndarray:
        """Which points `(M, 3)` lie in the part, or close to it."""
        close, found = CLOSE * self.fine, np.zeros(len(points), bool)
        local = (points - place.centre) @ place.rotation
        near = np.flatnonzero((np.abs(local) < part.body.half_extents + close).all(1))
        if len(near):
            found[near] = part.signed_distance(local[near])[0] < close
        return found


def _surface(body: Body, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points `(count, 3)` spread over a body's surface, in its frame, and their normals."""
    mesh = trimesh.Trimesh(body.solid_vertices, body.solid_faces, process=False)
    points, faces = trimesh.sample.sample_surface(mesh, count, seed=0)
    return np.asarray(points), np.asarray(mesh.face_normals[faces])


def _poses(places: Sequence[Place]) -> tuple[np.ndarray, np.ndarray]:
    """Rotations `(B, 3, 3)` and centres `(B, 3)`."""
    rotation, centre = [place.rotation for place in places], [place.centre for place in places]
    return np.array(rotation).reshape(-1, 3, 3), np.array(centre).reshape(-1, 3)


def _places(rotation: np.ndarray, centre: np.ndarray, scores: np.ndarray) -> list[Place]:
    return [Place(*pose) for pose in zip(rotation, centre, scores.tolist(), strict=True)]


def cost(place: Place) -> float:
    """What sorts places, the best first."""
    return -place.score


def apart(places: Iterable[Place], count: int, angle: float, reach: float) -> list[Place]:
    """The first ones of `places` that are not like an earlier one, `count` at most; see `Place.far_from`."""
    places = list(places)
    rotation, centres = _poses(places)
    turns = rotation.reshape(-1, 9)
    alike = (turns @ turns.T - 1) / 2 >= np.cos(angle)
    alike &= np.linalg.norm(centres[:, None] - centres[None], axis=2) <= reach
    kept: list[int] = []
    for i in range(len(places)):
        if not alike[i, kept].any():
            kept.append(i)
            if len(kept) == count:
                break
    return [places[i] for i in kept]
