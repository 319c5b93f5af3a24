"""Where a part of a broken thing belongs in what is still free of the whole.

A part's surface lies on the boundary of the free room wherever it was surface of the whole, or is a fracture whose
other side has its place already. All shifts of many turns are tried by Fourier transforms, as proteins are docked
(Katchalski-Katzir et al. 1992): voxels outside of the room cost, and the room's Laplacian rewards surface on boundary.
The best are drawn in by least squares on signed distances, point to plane (Chen & Medioni 1992), and judged by the
share of their surface that then lies where it should. The paper's signal is the silhouettes; this one is the kit's.
"""

from __future__ import annotations

import copy
import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
import trimesh
from scipy import fft, ndimage
from scipy.spatial.transform import Rotation

from . import sdf
from .containers import Container
from .meshes import Body

ROOMS = (24, 44), (40, 80)  # voxels along the whole's longest edge, coarse and fine; the second for small parts
SMALL = 0.17  # of that edge: radius of a small part
PAD = 3  # voxels about the whole, for parts that are turned a little wrong
BOUNDARY = 2.0  # reward of surface on boundary, against a voxel outside
TURNS = 800  # random rotations tried for each part
BRANCHES = 32  # places of these that are followed
DRAWN = 20  # places of those that are drawn in
POINTS = 600  # of a part's surface
STEPS = 20  # of least squares
NEAR = 3.0  # fine voxels from which a surface is drawn to a boundary, at first
CLOSE = 0.35  # fine voxels within which it counts as lying there, the more the nearer
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
        mesh = trimesh.Trimesh(body.solid_vertices, body.solid_faces, process=False)
        points, faces = trimesh.sample.sample_surface(mesh, POINTS, seed=0)
        self.points, self.normals = np.asarray(points), np.asarray(mesh.face_normals[faces])
        self.corners, self.area = mesh.convex_hull.vertices, float(mesh.area)
        self._stack = sdf.GridStack([self.grid])

    def signed_distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance and its gradient at points `(M, 3)` of the body's frame."""
        first = torch.zeros(len(points), dtype=torch.int64)
        value, gradient = self._stack.sample(first, torch.from_numpy(points).float())
        return value.numpy().astype(np.float64), gradient.numpy().astype(np.float64)


class Docking:
    """The whole, and the parts that have their places in it. attracts : False where the whole's surface is only a
    bound, and does not draw parts to it."""

    def __init__(self, whole: Container, attracts: bool = True):
        edge = float(np.ptp(whole.bounds, axis=0).max())
        self.whole, self.attracts = whole, attracts
        self.rooms = [[_Room(whole, edge / voxels) for voxels in pair] for pair in ROOMS]
        self.small = SMALL * edge
        self.placed: list[tuple[Part, Place]] = []

    def put(self, part: Part, place: Place) -> None:
        """Give a part its place."""
        self.placed.append((part, place))
        for coarse, fine in self.rooms:
            coarse.fill(part, place)
            fine.fill(part, place)

    def copy(self) -> Docking:
        """The same state, to go on from in another way."""
        twin = copy.copy(self)
        twin.rooms = [[copy.copy(room) for room in pair] for pair in self.rooms]
        twin.placed = list(self.placed)
        return twin

    def places(self, part: Part, random: np.random.Generator) -> list[Place]:
        """Places for a part, the best first, no two of them alike; empty where it fits nowhere."""
        radius, (coarse, fine) = part.body.radius, self._rooms(part)
        turns = Rotation.random(TURNS, random_state=random).as_matrix()
        found = _apart(coarse.best(part, turns), BRANCHES, 0.25, 0.3 * radius)
        for angle in (0.2, 0.1):
            tried = [fine.best(part, _about(place.rotation, angle, random)) for place in found]
            found = [best[0] for best in tried if best]
        found = _apart(found, DRAWN, 0.08, 0.1 * radius)
        return _apart(sorted(self.draw_in(part, found), key=_cost), DRAWN, 0.1, 0.1 * radius) if found else []

    def draw_in(self, part: Part, places: Sequence[Place]) -> list[Place]:
        """Near each place the one where most of the part's surface lies on the room's boundary, with its score."""
        rotation, centre = np.stack([place.rotation for place in places]), np.stack([place.centre for place in places])
        voxel = self._rooms(part)[1].voxel
        damping = np.diag([1e-4 * part.body.radius**2] * 3 + [1e-4] * 3)
        for step in range(STEPS):
            near = voxel * (NEAR * (1 - step / STEPS) + CLOSE / 2)
            square, slope = np.zeros((len(places), 6, 6)) + damping, np.zeros((len(places), 6))
            arms = (part.points @ rotation.swapaxes(1, 2)).reshape(-1, 3)
            for index, distance, normal, along, inwards in self._boundaries(part, rotation, centre, near):
                kept = ((np.abs(distance) < near) & (along > ALIKE)) | inwards
                index, distance, normal = index[kept], distance[kept], normal[kept]
                row = np.hstack([np.cross(arms[index], normal), normal])
                weighed = row / (1 + (distance / near) ** 2)[:, None]
                ends = np.searchsorted(index, np.arange(len(places) + 1) * POINTS)
                for k, (first, last) in enumerate(itertools.pairwise(ends)):
                    square[k] += weighed[first:last].T @ row[first:last] + damping * (last - first)
                    slope[k] += weighed[first:last].T @ distance[first:last]
            turn = -np.linalg.solve(square, slope[:, :, None])[:, :, 0]
            turn[:, :3] *= np.minimum(1, 0.15 / np.maximum(np.linalg.norm(turn[:, :3], axis=1), 1e-12))[:, None]
            rotation = Rotation.from_rotvec(turn[:, :3]).as_matrix() @ rotation
            centre = centre + turn[:, 3:]
        scores = self._scores(part, rotation, centre)
        return [Place(*pose) for pose in zip(rotation, centre, scores.tolist(), strict=True)]

    def score(self, part: Part, place: Place) -> float:
        """How much of the part's surface lies on the room's boundary, less twice the share that leaves the room."""
        return float(self._scores(part, place.rotation[None], place.centre[None])[0])

    def _scores(self, part: Part, rotation, centre) -> np.ndarray:
        close = CLOSE * self.rooms[0][1].voxel
        lies, leaves = np.zeros(len(rotation) * POINTS), np.zeros(len(rotation) * POINTS, bool)
        for index, distance, _, along, outside in self._boundaries(part, rotation, centre, close):
            near = np.clip(1 - np.abs(distance) / close, 0, 1) * (along > 0.75)
            lies[index] = np.maximum(lies[index], near)
            leaves[index] |= outside & (np.abs(distance) > close)
        return lies.reshape(-1, POINTS).mean(1) - OUTSIDE * leaves.reshape(-1, POINTS).mean(1)

    def _boundaries(self, part: Part, rotation, centre, near: float):
        """For the whole and each other part nearby, of B poses: which of the part's `(B x P)` points are near, and for
        each of these M: distance `(M,)`, its gradient `(M, 3)`, the cosine between the normals as they should lie, and
        whether the point is where it must not be."""
        turned = rotation.swapaxes(1, 2)
        points = (part.points @ turned + centre[:, None]).reshape(-1, 3)
        normals = (part.normals @ turned).reshape(-1, 3)
        found = self.whole.signed_distance(torch.from_numpy(points).float())
        distance, gradient = (x.numpy().astype(np.float64) for x in found)
        along = (normals * gradient).sum(1) if self.attracts else np.full(len(points), -1.0)
        yield np.arange(len(points)), distance, gradient, along, distance > 0
        for other, pose in self.placed:
            if other is part:
                continue
            local = (points - pose.centre) @ pose.rotation
            index = np.flatnonzero((np.abs(local) < other.body.half_extents + near).all(1))
            if len(index):
                distance, gradient = other.signed_distance(local[index])
                gradient = gradient @ pose.rotation.T
                yield index, distance, gradient, -(normals[index] * gradient).sum(1), distance < 0

    def _rooms(self, part: Part) -> list[_Room]:
        return self.rooms[part.body.radius < self.small]


class _Room:
    """What is free of the whole, as shares of voxels."""

    def __init__(self, whole: Container, voxel: float):
        low, high = whole.bounds
        self.voxel = voxel
        self.shape = np.ceil((high - low) / voxel).astype(int) + 2 * PAD
        self.first = (low + high - (self.shape - 1) * voxel) / 2  # the first voxel's middle
        middles = self.first + voxel * np.stack(np.indices(self.shape), -1).reshape(-1, 3)
        distance = whole.signed_distance(torch.from_numpy(middles).float())[0].numpy()
        self.free = np.clip(0.5 - distance / voxel, 0, 1).reshape(self.shape)
        self.padded = [fft.next_fast_len(int(n), real=True) for n in self.shape]
        self._spectrum = None

    def fill(self, part: Part, place: Place) -> None:
        """Take the part's volume away."""
        taken = self._share(part, place.rotation, self.first - place.centre, self.shape)
        self.free, self._spectrum = np.clip(self.free - taken, 0, 1), None

    def best(self, part: Part, turns: Iterable[np.ndarray]) -> list[Place]:
        """For each turn that fits its best shift, the best first; the score is not `Docking`'s."""
        if self._spectrum is None:
            cost = 1 - self.free + BOUNDARY * ndimage.gaussian_laplace(self.free, 1.0)
            self._spectrum = fft.rfftn(cost.astype(np.float32), self.padded)
        found = []
        for rotation in turns:
            corners = part.corners @ rotation.T
            first, last = (np.round(end / self.voxel).astype(int) for end in (corners.min(0), corners.max(0)))
            shape = last - first + 1
            if (shape > self.shape).any():
                continue
            share = self._share(part, rotation, first * self.voxel, shape).astype(np.float32)
            costs = fft.irfftn(self._spectrum * np.conj(fft.rfftn(share, self.padded)), self.padded)
            costs = costs[tuple(slice(0, n - s + 1) for n, s in zip(self.shape, shape, strict=True))]
            at = int(costs.argmin())
            shift = np.array(np.unravel_index(at, costs.shape)) - first
            found.append(Place(rotation, self.first + shift * self.voxel, -float(costs.flat[at])))
        return sorted(found, key=_cost)

    def _share(self, part: Part, rotation: np.ndarray, first: np.ndarray, shape: Sequence[int]) -> np.ndarray:
        """How much of each voxel a turned part fills; first `(3,)`: the first voxel's middle from the part's centre."""
        grid = part.grid
        distance = ndimage.affine_transform(
            grid.values,
            rotation.T * (self.voxel / grid.spacing),
            (rotation.T @ first - grid.origin) / grid.spacing,
            tuple(shape),
            order=1,
            mode="constant",
            cval=1.0,
        )
        return np.clip(0.5 - distance / self.voxel, 0, 1)


def _about(rotation: np.ndarray, angle: float, random: np.random.Generator) -> list[np.ndarray]:
    """The rotation itself and five others up to `angle` radians from it."""
    axes = random.normal(size=(5, 3))
    axes *= angle * random.uniform(0.3, 1, (5, 1)) / np.linalg.norm(axes, axis=1, keepdims=True)
    return [rotation, *(Rotation.from_rotvec(axes).as_matrix() @ rotation)]


def _cost(place: Place) -> float:
    return -place.score


def _apart(places: Sequence[Place], count: int, angle: float, reach: float) -> list[Place]:
    """The first ones of `places` that are not like an earlier one, `count` at most."""
    kept: list[Place] = []
    for place in places:
        if all(place.far_from(other, angle, reach) for other in kept):
            kept.append(place)
            if len(kept) == count:
                break
    return kept
