"""The points `p` of Eq. 3: a lattice in the container, and which bodies each point lies in.

A body is looked up only at the points in its own bounding box, never bodies x points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from .geometry.containers import Container
from .geometry.sdf import NEAR, GridStack
from .kernels import dispatch, wrenches
from .util import capacity
from .util.errors import InputError

QUERY_POINTS = 80_000  # the paper's


@dataclass(frozen=True)
class Lattice:
    """Query points on a regular lattice: origin `(3,)`, spacing in metres, shape `(X, Y, Z)`, z fastest.

    inside : flat bool, which points count, or None where all do. count : how many count; found out where None.
    """

    origin: Tensor
    spacing: float
    shape: tuple[int, int, int]
    inside: Tensor | None = None
    count: int | None = None

    def __post_init__(self):
        if self.count is None:
            count = math.prod(self.shape) if self.inside is None else int(self.inside.sum())
            object.__setattr__(self, "count", count)

    def points(self) -> Tensor:
        """All points, `(X * Y * Z, 3)`, those that do not count included."""
        axes = [torch.arange(n, device=self.origin.device) for n in self.shape]
        index = torch.stack(torch.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
        return self.origin + index.to(self.origin.dtype) * self.spacing

    def shifted(self, fraction: Tensor) -> Lattice:
        """The lattice moved by a `fraction` `(3,)` of its spacing; the same points count."""
        return replace(self, origin=self.origin + fraction * self.spacing)


def query_lattice(
    container: Container, count: int = QUERY_POINTS, device="cpu", dtype=torch.float32, volume: float = 1.0
) -> Lattice:
    """About `count` lattice points in the container, and as close ones around it.

    volume : the edge of the box that the lattice fills, over that of the container's bounding box; 1 for points within
    the walls alone. Raises InputError where count is not positive.
    """
    if count < 1:
        raise InputError(f"at least one query point is needed, got {count}")
    spacing = (container.volume / count) ** (1 / 3)
    low, high = (torch.as_tensor(corner, device=device, dtype=dtype) for corner in container.bounds)
    shape = [max(1, round(volume * float(edge) / spacing)) for edge in high - low]
    steps = torch.tensor(shape, device=device, dtype=dtype) - 1
    lattice = Lattice((low + high) / 2 - steps * spacing / 2, spacing, tuple(shape), None)
    if container.size is not None or volume > 1:
        return lattice
    return Lattice(lattice.origin, spacing, lattice.shape, container.signed_distance(lattice.points())[0] < 0)


def occupancy(stack: GridStack, half: Tensor, rotation: Tensor, translation: Tensor, lattice: Lattice) -> Tensor:
    """How many bodies each lattice point lies in, `(X, Y, Z)`; rotation `(N, 3, 3)`, translation `(N, 3)`."""
    if dispatch.compiled(rotation.device):
        poses = wrenches.arrays(rotation, translation)
        counts = occupancy_by_compiled_loops(for_kernels(stack, half, *poses, lattice), 1, lattice)
        return torch.from_numpy(counts[0].reshape(lattice.shape))
    with torch.no_grad():
        body, point, local, _ = possibly_inside(stack, half, rotation, translation, lattice)
        return bodies_at(point, stack.sample(body, local)[0] < 0, lattice).view(lattice.shape)


def occupancy_by_compiled_loops(scene: tuple, starts: int, lattice: Lattice) -> np.ndarray:
    """How many bodies of each start the flat lattice points lie in, `(S, P)`; scene : of `for_kernels`."""
    from .kernels import overlap

    counts = np.zeros((dispatch.workers(), starts, math.prod(lattice.shape)), np.int16)
    dispatch.in_parallel(overlap.count, *scene, counts)
    return counts.sum(0, np.int16)


def for_kernels(
    stack: GridStack, half: Tensor, rotation: np.ndarray, translation: np.ndarray, lattice: Lattice
) -> tuple:
    """What the loops in `kernels.overlap` have in common; rotation `(S, N, 3, 3)`, translation `(S, N, 3)`."""
    return (
        stack.arrays,
        half.numpy(),
        rotation,
        translation,
        np.array([*lattice.origin.tolist(), lattice.spacing]),
        lattice.shape,
        np.zeros(0, np.bool_) if lattice.inside is None else lattice.inside.numpy(),
    )


def bodies_at(point: Tensor, counts: Tensor, lattice: Lattice) -> Tensor:
    """How often each flat lattice point is among those of `point` `(M,)` that count, `(M,)` bool; `(X * Y * Z,)`
    int32."""
    tally = torch.zeros(math.prod(lattice.shape), dtype=torch.int32, device=point.device)
    return tally.index_add_(0, point, counts.int())


def possibly_inside(
    stack: GridStack, half: Tensor, rotation: Tensor, translation: Tensor, lattice: Lattice, least: int = 1
) -> tuple[Tensor, Tensor, Tensor, Tensor | None]:
    """Pairs (body, lattice point) that may lie inside: body `(M,)`, flat point `(M,)`, place in the body's frame
    `(M, 3)`, and which of them are real, see `util.capacity`.

    A body's box is cut out of the lattice column by column, so that a turned box costs its own volume and not that
    of the upright box about it. The grids' nearest values throw out what surely lies outside, and points that are left
    with fewer than `least` bodies.
    """
    device, h = rotation.device, lattice.spacing
    reach = (rotation.abs() @ half[:, :, None])[:, :, 0]
    top = torch.stack([torch.full((), n - 1, device=device) for n in lattice.shape])
    low = torch.minimum(((translation - reach - lattice.origin) / h).ceil().clamp(min=0).long(), top + 1)
    high = torch.minimum(((translation + reach - lattice.origin) / h).floor().long(), top)
    width = (high - low + 1).clamp(min=0)

    columns = width[:, 0] * width[:, 1]
    body, step, real = capacity.ranges(torch.zeros_like(columns), columns, "columns of lattice points")
    across = width[body, 1].clamp(min=1)
    ix = low[body, 0] + torch.div(step, across, rounding_mode="floor")
    iy = low[body, 1] + step % across
    # along a column the place in the body's frame is base + iz * rise
    foot = torch.stack([ix, iy, torch.zeros_like(ix)], 1).to(rotation.dtype) * h + lattice.origin - translation[body]
    base = (foot[:, None, :] @ rotation[body])[:, 0]
    rise = (rotation[:, 2] * h)[body]
    rise = torch.where(rise.abs() < 1e-12, 1e-12, rise)
    bound = half[body]
    enter, leave = (-bound - base) / rise, (bound - base) / rise
    first = torch.minimum(enter, leave).amax(1).ceil().clamp(min=0).long()
    last = torch.minimum(torch.maximum(enter, leave).amin(1).floor().clamp(-1, lattice.shape[2]).long(), top[2])
    lengths = capacity.only(real, (last - first + 1).clamp(min=0))

    column, iz, real = capacity.ranges(first, lengths, "lattice points in boxes")
    owner = body[column]
    point = capacity.only(real, ((ix * lattice.shape[1] + iy) * lattice.shape[2])[column] + iz)
    spacing = stack.spacing[body, None]
    cell = ((base - stack.origin[body]) / spacing)[column] + iz[:, None] * (rise / spacing)[column]
    value = stack.at_cells(owner, cell)
    kept = capacity.only(real, value < NEAR * stack.spacing[owner])
    if lattice.inside is not None:
        kept &= lattice.inside[point]
    if least > 1:
        kept &= bodies_at(point, kept, lattice)[point] >= least
    kept, real = capacity.found(kept, "lattice points near bodies")
    column, owner, point, iz = column[kept], owner[kept], point[kept], iz[kept]
    return owner, point, base[column] + iz[:, None] * rise[column], real
