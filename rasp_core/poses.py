"""Rigid poses: of many bodies at once (`Poses`), and how the loop learns them (`Variables`).

Three angles, whose rotations are the paper's (it makes them by way of quaternions); quaternions as the alternative.

A pose maps body to world, column vectors: `x_world = R @ x_body + t`. Quaternions are `(..., 4)`, scalar first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

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
        """Uniform rotations, or of those that are wished, centres uniform inside the container, as the paper starts."""
        generator = torch.Generator().manual_seed(seed)
        rotation = quaternion_to_rotation(random_quaternions(len(bodies), generator))
        random = np.random.default_rng(seed)
        for i, body in enumerate(bodies):
            if body.wishes.turns is not None:
                rotation[i] = torch.from_numpy(body.wishes.turns.random(random)).to(rotation)
        return cls(rotation, container.random_points(len(bodies), generator))

    def take(self, indices: Sequence[int]) -> Poses:
        """The poses of some of the bodies."""
        index = torch.as_tensor(list(indices), dtype=torch.int64)
        return Poses(self.rotation[index], self.translation[index])


class Variables:
    """The learned turns and shifts of the bodies that may move, the first `movers` ones, and the poses that they make
    of the start.

    turn : `(..., movers, 3)` angles in radians, or `(..., movers, 4)` quaternions where parametrisation is
    "quaternion". freedom `(movers, 3)` : 1 for the axes about which each may be turned, all if None.
    shift : `(..., movers, 3)`, in `width` metres.
    """

    def __init__(self, start: Poses, movers: int, width: float, parametrisation: str, freedom: Tensor | None = None):
        self.start, self.movers, self.width = start, movers, width
        if parametrisation == "angles":
            still, self.to_rotation, self.turn_rate = torch.zeros(3), angles_to_rotation, 1.0
        else:
            # a quaternion (1, d) turns by 2 d, so half the rate gives both parametrisations the same first step
            still, self.to_rotation, self.turn_rate = torch.tensor([1.0, 0, 0, 0]), quaternion_to_rotation, 0.5
        turn = still.expand(*start.translation.shape[:-2], movers, len(still)).clone()
        self.turn = turn.to(start.translation).requires_grad_()
        self.freedom = freedom
        if freedom is not None and len(still) == 4:
            self.freedom = torch.cat([torch.ones_like(freedom[:, :1]), freedom], 1)
        self.shift = torch.zeros_like(start.translation[..., :movers, :], requires_grad=True)

    def poses(self) -> tuple[Tensor, Tensor]:
        """Rotation `(..., N, 3, 3)` and translation `(..., N, 3)` of all bodies, differentiable."""
        movers, rotation, translation = self.movers, self.start.rotation, self.start.translation
        turn = self.turn if self.freedom is None else self.turn * self.freedom
        turned = self.to_rotation(turn) @ rotation[..., :movers, :, :]
        shifted = translation[..., :movers, :] + self.width * self.shift
        if movers == translation.shape[-2]:
            return turned, shifted
        obstacles = rotation[..., movers:, :, :], translation[..., movers:, :]
        return torch.cat([turned, obstacles[0]], -3), torch.cat([shifted, obstacles[1]], -2)

    @property
    def parameters(self) -> list[Tensor]:
        """What is learned: turn and shift."""
        return [self.turn, self.shift]

    def rates(self, rate: float) -> list[float]:
        """Of Adam's next step, for each parameter: `rate` radians for turns, as many viewing widths for shifts."""
        return [rate * self.turn_rate, rate]


def freedom_of(bodies: Sequence[Body]) -> np.ndarray | None:
    """`(N, 3)`: 1 for the world's axes about which each body may be turned a little, else 0; None if all are 1."""
    if all(body.wishes.turns is None for body in bodies):
        return None
    return np.array([np.ones(3) if body.wishes.turns is None else body.wishes.turns.freedom for body in bodies])


def snapped(bodies: Sequence[Body], rotation: Tensor) -> Tensor:
    """Rotations `(N, 3, 3)` without what rounding has taken them from the turns that are wished of the bodies."""
    for i, body in enumerate(bodies):
        if body.wishes.turns is not None:
            rotation[i] = torch.from_numpy(body.wishes.turns.nearest(rotation[i].numpy()))
    return rotation


def join(first: Poses, second: Poses) -> Poses:
    """The poses of both, in order, in the first's dtype."""
    rotation, translation = second.rotation.to(first.rotation.dtype), second.translation.to(first.translation.dtype)
    return Poses(torch.cat([first.rotation, rotation]), torch.cat([first.translation, translation]))


def to_world(rotation: Tensor, translation: Tensor, body: Tensor, points: Tensor) -> Tensor:
    """Points `(M, 3)` in the frames of `body` `(M,)` -> world."""
    return (rotation[body] @ points[:, :, None])[:, :, 0] + translation[body]


def file_to_world(bodies: Sequence[Body], rotation: Tensor, translation: Tensor) -> np.ndarray:
    """Poses of the bodies' centres -> `(N, 4, 4)` matrices that place the vertices of their files."""
    matrices = to_matrix(rotation.double().cpu(), translation.double().cpu()).numpy()
    centres = np.array([body.centre for body in bodies])
    matrices[:, :3, 3] -= np.einsum("nij,nj->ni", matrices[:, :3, :3], centres)
    return matrices


def from_matrices(bodies: Sequence[Body], matrices: np.ndarray) -> Poses:
    """The inverse of `file_to_world`: poses, in float64, of bodies whose files' vertices matrices `(N, 4, 4)` place."""
    rotation = matrices[:, :3, :3]
    centres = np.array([body.centre for body in bodies]).reshape(-1, 3)
    places = matrices[:, :3, 3] + np.einsum("nij,nj->ni", rotation, centres)
    return Poses(torch.from_numpy(np.array(rotation, np.float64)), torch.from_numpy(places))


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
    """`(..., 3)` angles about x, y, z in radians -> `(..., 3, 3)` rotation matrices.

    The turn about x comes first, then y, then z (all about the world's axes): R = Rz @ Ry @ Rx, each by Rodrigues'
    formula, 1 + sin(a) K + (1 - cos(a)) K^2.
    """
    cross, twice = _cross_products(angles_rad.device, angles_rad.dtype)
    sine, cosine = angles_rad.sin()[..., None, None], angles_rad.cos()[..., None, None]
    x, y, z = (sine * cross + (1 - cosine) * twice + cross.new_ones(3).diag()).unbind(-3)
    return z @ y @ x


@cache
def _cross_products(device: torch.device, dtype: torch.dtype) -> tuple[Tensor, Tensor]:
    """K `(3, 3, 3)`, by which K[i] @ v is the cross product of axis i and v, and K @ K."""
    axes = torch.eye(3, dtype=dtype)
    cross = torch.linalg.cross(axes[:, None], axes.expand(3, 3, 3)).mT
    return cross.to(device), (cross @ cross).to(device)


def rotation_to_angles(rotation: Tensor) -> Tensor:
    """`(..., 3, 3)` rotation matrices -> `(..., 3)` angles in radians that give them back."""
    y = torch.asin((-rotation[..., 2, 0]).clamp(-1, 1))
    locked = rotation[..., 2, 0].abs() > 1 - 1e-7
    x = torch.atan2(rotation[..., 2, 1], rotation[..., 2, 2])
    z = torch.atan2(rotation[..., 1, 0], rotation[..., 0, 0])
    x_locked = torch.atan2(-rotation[..., 1, 2], rotation[..., 1, 1])
    return torch.stack([torch.where(locked, x_locked, x), y, torch.where(locked, torch.zeros_like(z), z)], -1)


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


def degrees_between(first: Tensor, second: Tensor) -> Tensor:
    """Angle in degrees of the turn between two `(..., 3, 3)` rotations."""
    trace = (first * second).sum((-1, -2))
    return torch.rad2deg(torch.acos(((trace - 1) / 2).clamp(-1, 1))).clamp(0, math.degrees(math.pi))
