"""Rigid poses: of many bodies at once (`Poses`), and how they are parametrised.

Three angles -> quaternion -> rotation, as in the paper; quaternions directly as the alternative.

A pose maps body to world, column vectors: `x_world = R @ x_body + t`. Quaternions are `(..., 4)`, scalar first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from .geometry.containers import Container
from .geometry.meshes import Body


@dataclass(frozen=True)
class Poses:
    """Poses to start from: rotation `(N, 3, 3)`, translation `(N, 3)` of the bodies' centres, world."""

    rotation: Tensor
    translation: Tensor

    @classmethod
    def random(cls, bodies: Sequence[Body], container: Container, seed: int) -> Poses:
        """Uniform rotations, centres uniform inside the container, as the paper starts."""
        generator = torch.Generator().manual_seed(seed)
        rotation = quaternion_to_rotation(random_quaternions(len(bodies), generator))
        return cls(rotation, container.random_points(len(bodies), generator))

    def take(self, indices: Sequence[int]) -> Poses:
        """The poses of some of the bodies."""
        index = torch.as_tensor(list(indices), dtype=torch.int64)
        return Poses(self.rotation[index], self.translation[index])


def join(first: Poses, second: Poses) -> Poses:
    """The poses of both, in order."""
    pairs = (first.rotation, second.rotation), (first.translation, second.translation)
    return Poses(*(torch.cat([a, b.to(a.dtype)]) for a, b in pairs))


def to_world(rotation: Tensor, translation: Tensor, body: Tensor, points: Tensor) -> Tensor:
    """Points `(M, 3)` in the frames of `body` `(M,)` -> world."""
    return (rotation[body] @ points[:, :, None])[:, :, 0] + translation[body]


def file_to_world(bodies: Sequence[Body], rotation: Tensor, translation: Tensor) -> np.ndarray:
    """Poses of the bodies' centres -> `(N, 4, 4)` matrices that place the vertices of their files."""
    matrices = to_matrix(rotation.double().cpu(), translation.double().cpu()).numpy()
    centres = np.array([body.centre for body in bodies])
    matrices[:, :3, 3] -= np.einsum("nij,nj->ni", matrices[:, :3, :3], centres)
    return matrices


def angles_to_quaternion(angles_rad: Tensor) -> Tensor:
    """`(..., 3)` angles about x, y, z in radians -> `(..., 4)` unit quaternions.

    The turn about x comes first, then y, then z (all about the world's axes): R = Rz @ Ry @ Rx.
    """
    half = angles_rad / 2
    (cx, cy, cz), (sx, sy, sz) = half.cos().unbind(-1), half.sin().unbind(-1)
    return torch.stack(
        [
            cz * cy * cx + sz * sy * sx,
            cz * cy * sx - sz * sy * cx,
            cz * sy * cx + sz * cy * sx,
            sz * cy * cx - cz * sy * sx,
        ],
        -1,
    )


def quaternion_to_rotation(quaternion: Tensor) -> Tensor:
    """`(..., 4)` quaternions of any length but zero -> `(..., 3, 3)` rotation matrices."""
    w, x, y, z = (quaternion / quaternion.norm(dim=-1, keepdim=True)).unbind(-1)
    rows = [
        1 - 2 * (y * y + z * z),
        2 * (x * y - w * z),
        2 * (x * z + w * y),
        2 * (x * y + w * z),
        1 - 2 * (x * x + z * z),
        2 * (y * z - w * x),
        2 * (x * z - w * y),
        2 * (y * z + w * x),
        1 - 2 * (x * x + y * y),
    ]
    return torch.stack(rows, -1).unflatten(-1, (3, 3))


def angles_to_rotation(angles_rad: Tensor) -> Tensor:
    """`(..., 3)` angles about x, y, z in radians -> `(..., 3, 3)` rotation matrices."""
    return quaternion_to_rotation(angles_to_quaternion(angles_rad))


def rotation_to_angles(rotation: Tensor) -> Tensor:
    """`(..., 3, 3)` rotation matrices -> `(..., 3)` angles in radians that give them back."""
    y = torch.asin((-rotation[..., 2, 0]).clamp(-1, 1))
    locked = rotation[..., 2, 0].abs() > 1 - 1e-7
    x = torch.atan2(rotation[..., 2, 1], rotation[..., 2, 2])
    z = torch.atan2(rotation[..., 1, 0], rotation[..., 0, 0])
    x_locked = torch.atan2(-rotation[..., 1, 2], rotation[..., 1, 1])
    return torch.stack([torch.where(locked, x_locked, x), y, torch.where(locked, torch.zeros_like(z), z)], -1)


def rotation_to_quaternion(rotation: Tensor) -> Tensor:
    """`(..., 3, 3)` rotation matrices -> `(..., 4)` unit quaternions."""
    return angles_to_quaternion(rotation_to_angles(rotation))


def random_quaternions(count: int, generator: torch.Generator, dtype: torch.dtype = torch.float32) -> Tensor:
    """`(count, 4)` unit quaternions, uniform over all rotations (normalised Gaussians), on the CPU."""
    quaternion = torch.randn(count, 4, generator=generator, dtype=torch.float64)
    return (quaternion / quaternion.norm(dim=-1, keepdim=True)).to(dtype)


def to_matrix(rotation: Tensor, translation: Tensor) -> Tensor:
    """`(..., 3, 3)` and `(..., 3)` -> `(..., 4, 4)` homogeneous matrices."""
    matrix = torch.zeros(*rotation.shape[:-2], 4, 4, dtype=rotation.dtype, device=rotation.device)
    matrix[..., :3, :3] = rotation
    matrix[..., :3, 3] = translation
    matrix[..., 3, 3] = 1
    return matrix


def from_matrix(matrix: Tensor) -> tuple[Tensor, Tensor]:
    """`(..., 4, 4)` -> rotations `(..., 3, 3)` and translations `(..., 3)`."""
    return matrix[..., :3, :3], matrix[..., :3, 3]


def compose(outer: Tensor, inner: Tensor) -> Tensor:
    """`(..., 4, 4)` pose that applies `inner` first, then `outer`."""
    return outer @ inner


def invert(matrix: Tensor) -> Tensor:
    """`(..., 4, 4)` rigid poses -> their inverses."""
    rotation, translation = from_matrix(matrix)
    back = rotation.transpose(-1, -2)
    return to_matrix(back, -(back @ translation[..., None])[..., 0])


def degrees_between(first: Tensor, second: Tensor) -> Tensor:
    """Angle in degrees of the turn between two `(..., 3, 3)` rotations."""
    trace = (first * second).sum((-1, -2))
    return torch.rad2deg(torch.acos(((trace - 1) / 2).clamp(-1, 1))).clamp(0, math.degrees(math.pi))
