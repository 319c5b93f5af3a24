"""All objects moved and turned at once, a little at a time, so that the box becomes as small as it can: compaction.

At each step the distances of surface points to the other objects are taken to be linear in the moves, and a linear
programme finds the moves that make the box smallest while nothing gets nearer than it may; moves are limited to where
that holds (sequential linear programming; for translations in two dimensions Li & Milenkovic 1995, Compaction and
separation algorithms for non-convex polygons). What overlaps at first is drawn apart by the same steps. Distances are
exact (`mesh_distance`), so that thin parts, edges and corners count.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch
import trimesh
from scipy.optimize import linprog
from scipy.sparse import coo_matrix, hstack
from scipy.spatial.transform import Rotation

from ..geometry.containers import FreeBox
from ..geometry.meshes import Body
from ..geometry.surface_points import surface_points
from ..poses import Poses, freedom_of
from .mesh_distance import MeshDistance


@dataclass(frozen=True)
class CompactionTuning:
    """How the steps go; lengths are of the mean radius of the bodies."""

    spacing: float = 0.08  # of points on sharp edges and faces
    sharp_rad: float = 0.35  # angle between faces from which an edge is sharp
    most_points: int = 1500  # of a body
    first_step: float = 0.03  # that a body may move and, at its radius, turn by
    largest_step: float = 0.06
    least_step: float = 1e-4  # at which it ends
    longer: float = 1.3  # times, after a step that was good
    shorter: float = 0.4  # times, after one that was not
    points_of_pair: int = 14  # the nearest ones, of two bodies
    of_overlap: float = 10.0  # lengths of the box that a length of overlap costs
    of_walls: float = 100.0  # and one beyond a wall
    of_moves: float = 1e-4  # and one that a body moves
    gained: float = 1e-6  # by which a step must be better
    hardly: float = 1e-4  # better than this a step was worth it


TUNING = CompactionTuning()
MOST_BODIES = 250  # of which the linear programmes are solved in seconds


class Contact(NamedTuple):
    """Of two bodies, by number: points `(M, 3)` of the first, the nearest of those within reach of the second, the
    directions in which they go away from it `(M, 3)`, and how far they are `(M,)`, metres, in rising order."""

    first: int
    second: int
    points: np.ndarray
    away: np.ndarray
    apart: np.ndarray

    def within(self, reach: float) -> Contact:
        """The points nearer than a reach."""
        near = self.apart <= reach
        return Contact(self.first, self.second, self.points[near], self.away[near], self.apart[near])


@dataclass(frozen=True)
class Compacted:
    """rotation `(N, 3, 3)`, translation `(N, 3)` in a box about the origin, edges `(3,)`; beyond : metres beyond a
    wall. contacts : of bodies that overlap or nearly do. On the way zones are among the bodies, the last."""

    rotation: np.ndarray
    translation: np.ndarray
    edges: np.ndarray
    beyond: float
    contacts: list[Contact]

    @property
    def overlap(self) -> float:
        """Metres, the sum over pairs of bodies of how deep one lies in the other."""
        return -sum(min(float(contact.apart[0]), 0.0) for contact in self.contacts)

    @property
    def poses(self) -> Poses:
        """The same, float64."""
        return Poses(torch.from_numpy(self.rotation), torch.from_numpy(self.translation))


class Compaction:
    """Makes boxes of a shape about these bodies smaller, any number of times.

    Where no edge is free, overlaps are taken out, and that is all. apart : mean radii that are kept between bodies, if
    there is room, for what lies between the points.
    """

    def __init__(self, bodies: Sequence[Body], shape: FreeBox, apart: float = 0.0) -> None:
        self.shape, self.count, freedom = shape, len(bodies), freedom_of(bodies)
        self.unit = float(np.mean([body.radius for body in bodies]))
        self.apart = apart * self.unit
        all_bodies = [*bodies, *shape.zones]
        self.radius = np.array([body.radius for body in all_bodies])
        # which of the shifts, then of the turns, may be made
        self._movable = np.zeros((2, len(all_bodies), 3))
        self._movable[:, : self.count] = 1
        if freedom is not None:
            self._movable[1, : self.count] = freedom
        self._free = np.array([True, False, False]) if shape.cube else shape.free  # a cube has one edge
        # by how much the walls of an axis, the lower and the upper, go out as an edge gets longer
        self._goes_out = np.full((2, 3), 0.5) if not shape.zones else np.array([[0.5, 0.5, 0.0], [0.5, 0.5, 1.0]])
        spacing, solids = TUNING.spacing * self.unit, {body.digest: body for body in all_bodies}
        known = {key: (MeshDistance(body), _points(body, spacing), body.hull_corners) for key, body in solids.items()}
        self._distances, self._points, self._corners = zip(*(known[body.digest] for body in all_bodies), strict=True)

    def run(
        self, rotation: np.ndarray, translation: np.ndarray, edges: np.ndarray, late: Callable[[], bool]
    ) -> Compacted:
        """From poses `(N, 3, 3)`, `(N, 3)` in a box of `edges` `(3,)` about the origin, which may overlap a little, to
        where no step makes the box smaller."""
        step = TUNING.first_step * self.unit
        for zone in self.shape.zones:
            rotation = np.append(rotation, np.eye(3)[None], axis=0)
            translation = np.append(translation, [zone.centre - (0, 0, edges[2] / 2)], axis=0)
        now = self._measured(rotation, translation, edges, step)
        smaller = bool(self._free.any())
        length = float(now.edges[self._free].mean()) if smaller else 1.0
        while step > TUNING.least_step * self.unit and (smaller or now.overlap or now.beyond) and not late():
            moved = self._moved(now, step, length)
            if moved is None:
                step *= TUNING.shorter
                continue
            gain = self._cost(now, length) - self._cost(moved, length)
            if gain > TUNING.gained * self.unit:
                now, step = moved, self._longer(step)
            if gain < TUNING.hardly * self.unit:
                step *= TUNING.shorter
        return replace(now, rotation=now.rotation[: self.count], translation=now.translation[: self.count])

    # -- where bodies are ------------------------------------------------------------------------------------------

    def _longer(self, step: float) -> float:
        return min(TUNING.longer * step, TUNING.largest_step * self.unit)

    def _measured(self, rotation: np.ndarray, translation: np.ndarray, before: np.ndarray, step: float) -> Compacted:
        """Poses moved so that their box lies about the origin, and what overlaps or may after a further step; before :
        the edges of the box in which they lie now, of which zones keep all walls but the top."""
        moving = slice(0, self.count)
        placed = [c @ r.T + t for c, r, t in zip(self._corners[moving], rotation, translation, strict=False)]
        low, high = np.min([p.min(0) for p in placed], axis=0), np.max([p.max(0) for p in placed], axis=0)
        out = 0.0
        if self.shape.zones:
            floor, walls = -before / 2, np.array([*before[:2] / 2, np.inf])
            out = max(float((floor - low).max()), float((high - walls).max()), 0.0)
            low, high = floor, np.array([*walls[:2], high[2]])
        extent = high - low
        edges = self.shape.lengths(extent.max() if self.shape.cube else extent)
        beyond = max(float((extent - edges).max()) / 2, out, 0.0)
        translation = translation - (low + high) / 2
        return Compacted(rotation, translation, edges, beyond, self._contacts(rotation, translation, _reach(step)))

    def _cost(self, at: Compacted, length: float) -> float:
        """What a step is to lessen, metres: the logarithm of the volume, in lengths of the box, and what overlaps."""
        volume = length * np.log(at.edges[self._free]).sum()
        return float(volume + TUNING.of_overlap * at.overlap + TUNING.of_walls * at.beyond)

    def _contacts(self, rotation: np.ndarray, translation: np.ndarray, reach: float) -> list[Contact]:
        placed = [p @ r.T + t for p, r, t in zip(self._points, rotation, translation, strict=True)]
        low, high = np.array([p.min(0) for p in placed]), np.array([p.max(0) for p in placed])
        found = []
        for b, distance in enumerate(self._distances):
            meets = ((low < high[b] + reach) & (high > low[b] - reach)).all(1)
            meets[b] = False
            if b >= self.count:  # zones may overlap
                meets[self.count :] = False
            inside = {a: placed[a][_within(placed[a], low[b] - reach, high[b] + reach)] for a in np.flatnonzero(meets)}
            points = np.concatenate([np.empty((0, 3)), *inside.values()])
            owner = np.repeat(list(inside), [len(some) for some in inside.values()]).astype(int)
            local = (points - translation[b]) @ rotation[b]
            maybe = distance.maybe_within(local, reach)
            if not maybe.any():
                continue
            owner, points = owner[maybe], points[maybe]
            apart, away = distance.at(local[maybe])
            apart -= self.apart
            away = away @ rotation[b].T
            for a in np.unique(owner):
                of_a = np.flatnonzero(owner == a)
                nearest = of_a[np.argsort(apart[of_a])[: TUNING.points_of_pair]]
                found.append(Contact(int(a), b, points[nearest], away[nearest], apart[nearest]).within(reach))
        return [contact for contact in found if len(contact.points)]

    # -- a step --------------------------------------------------------------------------------------------------------

    def _moved(self, now: Compacted, step: float, length: float) -> Compacted | None:
        """After the best moves of at most a step along each axis, and turns that move a body's radius by as much; None
        if the programme has no answer.

        Unknowns: shifts and turns of N bodies, the box's edges, what each pair overlaps by, and what walls are passed
        by.
        """
        count = len(self.radius)
        near = [contact.within(_reach(step)) for contact in now.contacts]
        contacts = [contact for contact in near if len(contact.points)]
        edge_at, overlap_at = 6 * count, 6 * count + 3
        beyond_at = overlap_at + len(contacts)
        rows = _Rows()
        for k, (a, b, points, away, apart) in enumerate(contacts):
            rows.add(
                self._pushed(a, points - now.translation[a], -away),
                self._pushed(b, points - now.translation[b], away),
                [(overlap_at + k, -np.ones(len(points)))],
                limit=apart,
            )
        for i, corners in enumerate(self._corners[: self.count]):
            arms = corners @ now.rotation[i].T
            for axis in range(3):
                for side, goes_out in zip((-1.0, 1.0), self._goes_out[:, axis], strict=True):
                    reached = side * (arms[:, axis] + now.translation[i, axis])
                    near = reached > now.edges[axis] / 2 - 8 * step
                    if not near.any():
                        continue
                    wall = [(beyond_at, -np.ones(near.sum()))]
                    limit = now.edges[axis] / 2 - reached[near]
                    if self.shape.free[axis]:
                        limit = limit - goes_out * now.edges[axis]
                        wall.append((edge_at + (0 if self.shape.cube else axis), np.full(near.sum(), -goes_out)))
                    outward = np.tile(side * np.eye(3)[axis], (near.sum(), 1))
                    rows.add(self._pushed(i, arms[near], outward), wall, limit=limit)
        cost = np.zeros(beyond_at + 1)
        cost[edge_at:overlap_at][self._free] = length / now.edges[self._free]
        cost[overlap_at:beyond_at], cost[beyond_at] = TUNING.of_overlap, TUNING.of_walls
        matrix, limits = rows.matrix(len(cost))
        # moves to one side and to the other are unknowns of their own, so that what need not move stays
        matrix = hstack([matrix[:, :edge_at], -matrix[:, :edge_at], matrix[:, edge_at:]])
        cost = np.concatenate([np.full(2 * edge_at, TUNING.of_moves), cost[edge_at:]])
        most = np.tile(step * self._movable.ravel(), 2)
        bounds = [(0, limit) for limit in most] + [(0, None)] * (len(cost) - 2 * edge_at)
        solved = linprog(cost, A_ub=matrix, b_ub=limits, bounds=bounds, method="highs")
        if solved.x is None:
            return None
        moves = (solved.x[:edge_at] - solved.x[edge_at : 2 * edge_at]).reshape(-1, 3)
        shifts, turns = moves[:count], moves[count:]
        turned = Rotation.from_rotvec(turns / self.radius[:, None]).as_matrix() @ now.rotation
        return self._measured(turned, now.translation + shifts, now.edges, self._longer(step))

    def _pushed(self, body: int, arms: np.ndarray, directions: np.ndarray) -> list[tuple[int, np.ndarray]]:
        """How far points at `arms` `(M, 3)` from a body's centre go along directions `(M, 3)`, for each of its unknowns
        the coefficients `(M,)`."""
        turning = np.cross(arms, directions) / self.radius[body]
        first = 3 * len(self.radius)
        return [
            *((3 * body + axis, directions[:, axis]) for axis in range(3)),
            *((first + 3 * body + axis, turning[:, axis]) for axis in range(3)),
        ]


class _Rows:
    """Inequalities that are added block by block."""

    def __init__(self) -> None:
        self.count, self._limits, self._entries = 0, [], []

    def add(self, *unknowns: list[tuple[int, np.ndarray]], limit: np.ndarray) -> None:
        """The sum of unknowns, by their numbers, times coefficients `(M,)`, is at most limit `(M,)`."""
        rows = np.arange(self.count, self.count + len(limit))
        for number, coefficients in (pair for pairs in unknowns for pair in pairs):
            self._entries.append((coefficients, rows, np.full(len(limit), number)))
        self._limits.append(limit)
        self.count += len(limit)

    def matrix(self, unknowns: int) -> tuple[coo_matrix, np.ndarray]:
        """All of them, `(rows, unknowns)` and `(rows,)`."""
        values, rows, columns = (np.concatenate(parts) for parts in zip(*self._entries, strict=True))
        return coo_matrix((values, (rows, columns)), (self.count, unknowns)).tocsr(), np.concatenate(self._limits)


def _reach(step: float) -> float:
    """Metres by which two bodies may come nearer to each other in a step along each axis."""
    return 2 * np.sqrt(3) * step


def _points(body: Body, spacing: float) -> np.ndarray:
    """Points of a body's surface, `(M, 3)` about its centre: corners, then sharp edges and faces at a spacing."""
    mesh = trimesh.Trimesh(body.solid_vertices, body.solid_faces, process=False)
    ends = mesh.vertices[mesh.face_adjacency_edges[mesh.face_adjacency_angles > TUNING.sharp_rad]]
    counts = np.ceil(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / spacing).astype(int)
    along = [a + (b - a) * (np.arange(n + 1) / n)[:, None] for (a, b), n in zip(ends, counts, strict=True) if n]
    corners = np.unique(np.concatenate([body.hull_corners, *along]), axis=0)
    count = min(int(mesh.area / spacing**2) + 1, TUNING.most_points)
    spread, _ = surface_points(body.solid_vertices, body.solid_faces, count)
    points = np.concatenate([corners, spread])
    if len(points) <= TUNING.most_points:
        return points
    return points[np.random.default_rng(0).choice(len(points), TUNING.most_points, replace=False)]


def _within(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    return ((points > low) & (points < high)).all(1)
