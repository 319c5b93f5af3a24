"""Where a part of a broken thing belongs in what is still free of the whole.

A part's surface lies on the boundary of the free room wherever it was surface of the whole, or is a fracture whose
other side has its place already. All shifts of many turns are tried by Fourier transforms, as proteins are docked
(Katchalski-Katzir et al. 1992): voxels outside of the room cost, and the room's Laplacian rewards surface on boundary.
The best are drawn in by least squares on signed distances, point to plane (Chen & Medioni 1992), and judged by the
share of their surface that then lies where it should. The paper's signal is the silhouettes; this one is the kit's.
"""

from __future__ import annotations

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
CLOSE = 0.35  # fine voxels within which it counts as lying there
ALIKE = 0.6  # least cosine between normals that are drawn together
OUTSIDE = 2.0  # what surface outside of the room costs, against surface on its boundary


@dataclass(frozen=True)
class Place:
    """A pose of a part: rotation `(3, 3)`, its centre's place `(3,)`; score, the larger the better, 1 at most."""

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
        self.corners = mesh.convex_hull.vertices
        self._stack = sdf.GridStack([self.grid])

    def signed_distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance and its gradient at points `(M, 3)` of the body's frame."""
        first = torch.zeros(len(points), dtype=torch.int64)
        value, gradient = self._stack.sample(first, torch.from_numpy(points).float())
        return value.numpy().astype(np.float64), gradient.numpy().astype(np.float64)


class Docking:
    """The whole, and the parts that have their places in it."""

    def __init__(self, whole: Container, random: np.random.Generator):
        edge = float(np.ptp(whole.bounds, axis=0).max())
        self.whole, self.random = whole, random
        self.rooms = [[_Room(whole, edge / voxels) for voxels in pair] for pair in ROOMS]
        self.small = SMALL * edge
        self.placed: list[tuple[Part, Place]] = []

    def put(self, part: Part, place: Place) -> None:
        """Give a part its place."""
        self.placed.append((part, place))
        for coarse, fine in self.rooms:
            coarse.fill(part, place)
            fine.fill(part, place)

    def places(self, part: Part) -> list[Place]:
        """Places for a part, the best first, no two of them alike; empty where it fits nowhere."""
        radius, (coarse, fine) = part.body.radius, self._rooms(part)
        turns = Rotation.random(TURNS, random_state=self.random).as_matrix()
        found = _apart(coarse.best(part, turns), BRANCHES, 0.25, 0.3 * radius)
        for angle in (0.2, 0.1):
            found = [
                min(fine.best(part, self._about(place.rotation, angle)), key=_cost, default=None) for place in found
            ]
            found = [place for place in found if place is not None]
        found = _apart(found, DRAWN, 0.08, 0.1 * radius)
        drawn = sorted((self.draw_in(part, place) for place in found), key=_cost)
        return _apart(drawn, DRAWN, 0.1, 0.1 * radius)

    def draw_in(self, part: Part, place: Place) -> Place:
        """The place nearby where most of the part's surface lies on the room's boundary, with its score."""
        rotation, centre, voxel = place.rotation, place.centre, self._rooms(part)[1].voxel
        others = [(other, pose) for other, pose in self.placed if other is not part]
        for step in range(STEPS):
            near = voxel * (NEAR * (1 - step / STEPS) + CLOSE / 2)
            rows, residuals = [], []
            for distance, normal, along, inwards in self._boundaries(part, rotation, centre, others, near):
                kept = ((np.abs(distance) < near) & (along > ALIKE)) | inwards
                arm = (part.points @ rotation.T)[kept]
                rows.append(np.hstack([np.cross(arm, normal[kept]), normal[kept]]))
                residuals.append(distance[kept])
            row, residual = np.vstack(rows), np.concatenate(residuals)
            weight = 1 / (1 + (residual / near) ** 2)
            damping = np.diag([1e-4 * part.body.radius**2] * 3 + [1e-4] * 3) * (1 + len(residual))
            turn = -np.linalg.solve((row * weight[:, None]).T @ row + damping, (row * weight[:, None]).T @ residual)
            turn[:3] *= min(1, 0.15 / max(np.linalg.norm(turn[:3]), 1e-12))
            rotation = Rotation.from_rotvec(turn[:3]).as_matrix() @ rotation
            centre = centre + turn[3:]
        return Place(rotation, centre, self._score(part, rotation, centre, others))

    def _score(self, part: Part, rotation, centre, others) -> float:
        close = CLOSE * self.rooms[0][1].voxel
        lies, leaves = np.zeros(len(part.points), bool), np.zeros(len(part.points), bool)
        for distance, _, along, outside in self._boundaries(part, rotation, centre, others, close):
            lies |= (np.abs(distance) < close) & (along > 0.75)
            leaves |= outside & (np.abs(distance) > close)
        return float(lies.mean() - OUTSIDE * leaves.mean())

    def _boundaries(self, part: Part, rotation, centre, others, near: float):
        """For the whole and each part nearby: the distance of the part's points to it `(P,)`, its gradient `(P, 3)`,
        the cosine between the normals as they should lie, and whether a point is where it must not be."""
        points, normals = part.points @ rotation.T + centre, part.normals @ rotation.T
        found = self.whole.signed_distance(torch.from_numpy(points).float())
        distance, gradient = (x.numpy().astype(np.float64) for x in found)
        yield distance, gradient, (normals * gradient).sum(1), distance > 0
        for other, pose in others:
            local = (points - pose.centre) @ pose.rotation
            inside = (np.abs(local) < other.body.half_extents + near).all(1)
            if inside.any():
                distance, gradient = np.full(len(points), np.inf), np.zeros_like(points)
                distance[inside], slope = other.signed_distance(local[inside])
                gradient[inside] = slope @ pose.rotation.T
                yield distance, gradient, -(normals * gradient).sum(1), distance < 0

    def _rooms(self, part: Part) -> list[_Room]:
        return self.rooms[part.body.radius < self.small]

    def _about(self, rotation: np.ndarray, angle: float) -> list[np.ndarray]:
        """The rotation itself and five others up to `angle` radians from it."""
        axes = self.random.normal(size=(5, 3))
        axes *= angle * self.random.uniform(0.3, 1, (5, 1)) / np.linalg.norm(axes, axis=1, keepdims=True)
        return [rotation, *(Rotation.from_rotvec(axes).as_matrix() @ rotation)]


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
