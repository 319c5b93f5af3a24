"""What every loss of the kit boils down to: forces at points of rigid bodies.

A loss whose value changes by `f . dx` when a point of body i moves by dx has the gradients
`dL/dt_i = sum f` and, along rotations, `dL/dR_i = sum f (outer) q`, with q the point in the body's frame. The losses
compute their value and these sums, a wrench for each body, in one pass, without autograd's buffers; `loss` hands them
to autograd.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor

from . import dispatch

SMALLEST = 1e-200  # force that differs from none


def loss(rotation: Tensor, translation: Tensor, compiled: Callable, plain: Callable) -> Tensor:
    """A loss, differentiable in the poses, by compiled loops or in plain torch, as `dispatch` chooses.

    rotation `(N, 3, 3)` and translation `(N, 3)` of one start give a scalar, `(S, N, 3, 3)` and `(S, N, 3)` a value for
    each start. Both functions are called with the poses of S starts; forces are in the world, points in body frames:
    compiled : arrays -> sums `(S, N, 13)`, each body's part of the value, then its wrench as `gather` has it.
    plain : tensors -> values `(S,)` and wrenches `(S, N, 4, 3)`.
    """
    if dispatch.compiled(rotation.device):
        sums = torch.from_numpy(compiled(*arrays(rotation, translation))).to(rotation.dtype)
        sums = sums.view(*translation.shape[:-1], 13)
        value, wrench = sums[..., 0].sum(-1), sums[..., 1:].unflatten(-1, (4, 3))
    else:
        count = rotation.shape[-3]
        with torch.no_grad():
            value, wrench = plain(rotation.reshape(-1, count, 3, 3), translation.reshape(-1, count, 3))
        value, wrench = value.view(translation.shape[:-2]), wrench.view(*translation.shape[:-1], 4, 3)
    return differentiable(value, rotation, translation, *gradients(wrench))


def each_start(plain: Callable) -> Callable:
    """`plain` for `loss`, of a function that takes one start's poses and returns a scalar and a wrench `(N, 4, 3)`."""

    def starts(rotation: Tensor, translation: Tensor) -> tuple[Tensor, Tensor]:
        found = [plain(turns, places) for turns, places in zip(rotation, translation, strict=True)]
        return torch.stack([value for value, _ in found]), torch.stack([wrench for _, wrench in found])

    return starts


class _Differentiable(torch.autograd.Function):
    @staticmethod
    def forward(ctx, rotation, translation, value, d_rotation, d_translation):
        ctx.save_for_backward(d_rotation, d_translation)
        return value.clone()

    @staticmethod
    def backward(ctx, upstream):
        d_rotation, d_translation = ctx.saved_tensors
        upstream = upstream[..., None, None]
        return upstream[..., None] * d_rotation, upstream * d_translation, None, None, None


def differentiable(
    value: Tensor, rotation: Tensor, translation: Tensor, d_rotation: Tensor, d_translation: Tensor
) -> Tensor:
    """A scalar, or one for each start, with the given value and gradients.

    rotation `(N, 3, 3)`, translation `(N, 3)`; d_rotation and d_translation of the same shapes; value `()`. With S
    starts `(S, N, 3, 3)`, `(S, N, 3)` and `(S,)`. The gradient in the rotation is right along rotations (through
    `poses`), not off them.
    """
    return _Differentiable.apply(rotation, translation, value, d_rotation, d_translation)


def arrays(rotation: Tensor, translation: Tensor) -> tuple[np.ndarray, np.ndarray]:
    """Poses of one or S starts as the compiled loops want them: `(S, N, 3, 3)` and `(S, N, 3)`."""
    count = rotation.shape[-3]
    rotation, translation = rotation.detach().contiguous().numpy(), translation.detach().contiguous().numpy()
    return rotation.reshape(-1, count, 3, 3), translation.reshape(-1, count, 3)


def gather(count: int, body: Tensor, point: Tensor, force: Tensor) -> Tensor:
    """Sum forces and their moments for each body: `(count, 4, 3)`, row 0 the force, rows 1-3 point (outer) force.

    body `(M,)` int64, point and force `(M, 3)` in one frame.

    Summed by `sum_in_steps`, in steps as small as 64 bits allow.
    """
    rows = torch.cat([force, (point[:, :, None] * force[:, None, :]).flatten(1)], 1)
    if not len(rows):
        return rows.new_zeros(count, 4, 3)
    bits = rows.abs().amax().double().clamp(min=SMALLEST).log2().ceil() + len(rows).bit_length()
    return sum_in_steps(count, body, rows, torch.exp2(bits - 62)).view(count, 4, 3)


def sum_in_steps(count: int, index: Tensor, values: Tensor, step: float | Tensor) -> Tensor:
    """The sums `(count, ...)` of those `values` `(M, ...)` that `index` `(M,)` sends to each place.

    They are taken as whole numbers of steps, so that the order in which a GPU adds does not matter. A sum must be less
    than 2^63 steps.
    """
    whole = torch.zeros(count, *values.shape[1:], dtype=torch.int64, device=values.device)
    whole.index_add_(0, index, (values / step).round().long())
    return (whole.double() * step).to(values.dtype)


def gradients(wrench_world: Tensor) -> tuple[Tensor, Tensor]:
    """`(..., 4, 3)` sums of world forces at body-frame points -> d_rotation `(..., 3, 3)`, d_translation `(..., 3)`."""
    return wrench_world[..., 1:, :].transpose(-1, -2), wrench_world[..., 0, :]


def to_world(wrench_body: Tensor, rotation: Tensor) -> Tensor:
    """Sums of forces given in body frames `(N, 4, 3)` -> the same with the forces turned into the world."""
    return wrench_body @ rotation.transpose(1, 2)
