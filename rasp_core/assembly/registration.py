"""Poses of one part in a whole in which other parts are placed already.

A part's surface lies against the whole's wherever it was surface of the whole; elsewhere it is a fracture, and lies
against the other side of that fracture once the neighbour is placed. Pairs of points with equal features on the part
and on these surfaces give poses (`point_pair_features`); the best are refined by least squares on signed distances,
point to plane, and scored. The paper's signal is the silhouettes; this one is the kit's.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from ..geometry import sdf
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..geometry.surface_points import surface_points
from . import point_pair_features
from .scored_poses import ScoredPose, best_first, distinct, stack, unstack


@dataclass(frozen=True)
class Screening:
    """Keep the best `kept` poses by the first `points` points of the part; contact counts up to `contact_factor` times
    its distance."""

    points: int
    kept: int
    contact_factor: float


@dataclass(frozen=True)
class RegistrationSettings:
    """Of the search for one part's poses. A unit is the whole's longest edge over `units_per_edge`.

    small_radius_edges : radius, in that edge, under which a part is refined in finer units. contact_units : how near a
    point must be to lie on a surface. reach_units : from where points are pulled to a surface, in the first refinement
    step. A cosine is the least one between a normal and the normal that the surface asks for. apart : two poses that
    differ by less, in radians or in radii of the part, are the same.
    """

    units_per_edge: int = 44
    small_units_per_edge: int = 80
    small_radius_edges: float = 0.17
    whole_points: int = 4000
    part_points: int = 600
    screenings: tuple[Screening, ...] = (Screening(30, 3000, 3.0), Screening(100, 400, 2.0))
    refined: int = 60
    returned: int = 20
    refined_apart_rad: float = 0.12
    returned_apart_rad: float = 0.1
    apart_radii: float = 0.1
    refinement_steps: int = 20
    reach_units: float = 3.0
    contact_units: float = 0.35
    refinement_cosine: float = 0.6
    score_cosine: float = 0.75
    outside_penalty: float = 2.0
    damping: float = 1e-4
    largest_turn_rad: float = 0.15


SETTINGS = RegistrationSettings()


class Part:
    """A body with its signed distance grid, and points `(P, 3)` on its surface with their normals, in its frame."""

    def __init__(self, body: Body):
        self.body, self.grid = body, sdf.bake_cached(body)
        self.points, self.normals = surface_points(body.solid_vertices, body.solid_faces, SETTINGS.part_points)
        self.area = body.manifold.surface_area()
        self._stack = sdf.GridStack([self.grid])

    def signed_distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance `(M,)` in metres and its gradient `(M, 3)` at points `(M, 3)` of the body's frame."""
        first = torch.zeros(len(points), dtype=torch.int64)
        value, gradient = self._stack.sample(first, torch.from_numpy(points).float())
        return value.numpy().astype(np.float64), gradient.numpy().astype(np.float64)


class PartialAssembly:
    """The whole, and the parts that are placed in it.

    match_whole : whether parts lie against the whole's surface; else it is only a bound, as a visual hull is.
    placed : the parts with their poses. boundary, normals `(M, 3)`, owner `(M,)` : points that nothing covers, of the
    whole's surface (owner -1) and of placed parts' fractures (by their number), and the normals that a part's surface
    there must have.
    """

    def __init__(self, whole: Container, match_whole: bool = True):
        edge = float(np.ptp(whole.bounds, axis=0).max())
        self.whole, self.match_whole = whole, match_whole
        self.unit, self.small_unit = edge / SETTINGS.units_per_edge, edge / SETTINGS.small_units_per_edge
        self.small_radius = SETTINGS.small_radius_edges * edge
        self.contact = SETTINGS.contact_units * self.unit
        self.placed: list[tuple[Part, ScoredPose]] = []
        self._wall = whole.arrays(torch.float32)
        self._note_placed()
        body = whole.body
        points, self.normals = surface_points(body.solid_vertices, body.solid_faces, SETTINGS.whole_points)
        self.boundary = points + whole.body.centre
        self._surface, self._outwards = cKDTree(self.boundary), self.normals
        self.owner = np.full(len(points), -1)

    def add(self, part: Part, pose: ScoredPose) -> None:
        """Place a part; its fractures join the boundary, and what it covers leaves it."""
        free = ~self._covered(part, pose, self.boundary)
        points, normals = part.points @ pose.rotation.T + pose.translation, part.normals @ pose.rotation.T
        away, nearest = self._surface.query(points)
        cosine = (normals * self._outwards[nearest]).sum(1)
        depth = -self.whole.signed_distance(torch.from_numpy(points).float())[0].numpy()
        bare = (depth > self.contact / 2) & ((cosine < SETTINGS.refinement_cosine) | (away > 2 * self.unit))
        for other, there in self.placed:
            bare &= ~self._covered(other, there, points)
        self.owner = np.append(self.owner[free], np.full(bare.sum(), len(self.placed)))
        self.boundary = np.concatenate([self.boundary[free], points[bare]])
        self.normals = np.concatenate([self.normals[free], -normals[bare]])
        self.placed.append((part, pose))
        self._note_placed()

    def set_pose(self, number: int, pose: ScoredPose) -> None:
        """Give the placed part of that number another pose nearby; the boundary stays as it was."""
        self.placed[number] = self.placed[number][0], pose

    def copy(self) -> PartialAssembly:
        """The same state, to go on from in another way."""
        twin = copy.copy(self)
        twin.placed = list(self.placed)
        return twin

    def find_poses(self, part: Part, random: np.random.Generator, touching: int | None = None) -> list[ScoredPose]:
        """Poses of a part, the best first, no two the same; empty if it fits nowhere.

        touching : only poses that touch the placed part of this number.
        """
        fracture = np.flatnonzero(self.owner >= 0 if touching is None else self.owner == touching)
        references = fracture
        if touching is None:
            outer = random.permutation(np.flatnonzero(self.owner < 0))
            references = np.append(fracture, outer[: max(len(fracture), len(outer) // 8)])
        if not len(references):
            return []
        rotation, translation = point_pair_features.poses(
            part=(part.points, part.normals),
            boundary=(self.boundary, self.normals),
            references=references,
            diameter=2 * part.body.radius,
            random=random,
        )
        scores = np.zeros(len(rotation))
        for screening in SETTINGS.screenings:
            scores = self._scores(part, rotation, translation, screening.points, screening.contact_factor)
            best = np.argsort(-scores, kind="stable")[: screening.kept]
            rotation, translation, scores = rotation[best], translation[best], scores[best]
        apart = SETTINGS.apart_radii * part.body.radius
        likely = distinct(
            unstack(rotation, translation, scores), SETTINGS.refined, SETTINGS.refined_apart_rad, distance=apart
        )
        refined = [pose for pose in self.refine(part, likely) if pose.score > 0] if likely else []
        return distinct(best_first(refined), SETTINGS.returned, SETTINGS.returned_apart_rad, distance=apart)

    def refine(self, part: Part, poses: Sequence[ScoredPose]) -> list[ScoredPose]:
        """Near each pose the one under which most of the part's surface lies on the boundary, with its score."""
        from ..kernels import point_to_plane

        rotation, translation = stack(poses)
        unit = self.small_unit if part.body.radius < self.small_radius else self.unit
        damping = np.diag([SETTINGS.damping * part.body.radius**2] * 3 + [SETTINGS.damping] * 3)
        for step in range(SETTINGS.refinement_steps):
            left = 1 - step / SETTINGS.refinement_steps
            near = unit * (SETTINGS.reach_units * left + SETTINGS.contact_units / 2)
            square, slope, rows = point_to_plane.normal_equations(
                **self._surfaces(part),
                rotation=rotation,
                translation=translation,
                contact=point_to_plane.Contact(distance=near, cosine=SETTINGS.refinement_cosine),
            )
            square += damping * (1 + rows)[:, None, None]
            move = -np.linalg.solve(square, slope[:, :, None])[:, :, 0]
            angle = np.maximum(np.linalg.norm(move[:, :3], axis=1), 1e-12)
            move[:, :3] *= np.minimum(1, SETTINGS.largest_turn_rad / angle)[:, None]
            rotation = Rotation.from_rotvec(move[:, :3]).as_matrix() @ rotation
            translation = translation + move[:, 3:]
        return unstack(rotation, translation, self._scores(part, rotation, translation))

    def score(self, part: Part, pose: ScoredPose) -> float:
        """The fraction of the part's surface that lies on the boundary, the nearer the more, less `outside_penalty`
        times the fraction that lies outside."""
        return self.rescored(part, [pose])[0].score

    def rescored(self, part: Part, poses: Sequence[ScoredPose]) -> list[ScoredPose]:
        """The same poses with the scores that they have now."""
        rotation, translation = stack(poses)
        return unstack(rotation, translation, self._scores(part, rotation, translation))

    def _scores(self, part: Part, rotation, translation, points: int | None = None, contact_factor: float = 1.0):
        """`(B,)`, by the first `points` of the part's points, all if None."""
        from ..kernels import point_to_plane

        distance = contact_factor * SETTINGS.contact_units * self.unit
        covered, outside = point_to_plane.coverage(
            **self._surfaces(part, points),
            rotation=rotation,
            translation=translation,
            contact=point_to_plane.Contact(distance=distance, cosine=SETTINGS.score_cosine),
        )
        return covered - SETTINGS.outside_penalty * outside

    def _surfaces(self, part: Part, points: int | None = None) -> dict:
        """What the compiled loops are given of the part and of what it meets."""
        from ..kernels.point_to_plane import Placed, Surface, Whole

        rotation, translation = stack([pose for _, pose in self.placed])
        return {
            "part": Surface(part.points[:points], part.normals[:points]),
            "whole": Whole(self._wall, self.match_whole),
            "placed": Placed(**self._solids, rotation=rotation, translation=translation),
            "skip": next((k for k, (other, _) in enumerate(self.placed) if other is part), -1),
        }

    def _note_placed(self) -> None:
        """Keep the placed parts' grids, boxes and radii as arrays."""
        parts = [part for part, _ in self.placed]
        self._solids = {
            "grids": sdf.GridStack([part.grid for part in parts]).arrays,
            "half_extents": np.array([part.body.half_extents for part in parts]).reshape(-1, 3),
            "radius": np.array([part.body.radius for part in parts]),
        }

    def _covered(self, part: Part, pose: ScoredPose, points: np.ndarray) -> np.ndarray:
        """Which points `(M, 3)` lie in the part, or on its surface."""
        found = np.zeros(len(points), bool)
        local = (points - pose.translation) @ pose.rotation
        near = np.flatnonzero((np.abs(local) < part.body.half_extents + self.contact).all(1))
        if len(near):
            found[near] = part.signed_distance(local[near])[0] < self.contact
        return found
