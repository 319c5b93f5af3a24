"""The paper's losses, each with its equation.

    L_total = L_sil + L_is + lambda * L_ext          (Eq. 1)

All take rotations `(N, 3, 3)` and translations `(N, 3)` and are differentiable in them (along rotations); with those of
S starts, `(S, N, 3, 3)` and `(S, N, 3)`, they give a value for each start. An object is looked up only at the points in
its own bounding box, never objects x points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from . import silhouettes
from .geometry.containers import Container
from .geometry.sdf import NEAR, GridStack
from .kernels import dispatch, wrenches
from .util.errors import InputError

LAMBDA = 0.001  # weight of the extrusion term, the paper's
EPSILON = 0.01  # metres; how deep inside the container the extrusion term stops rewarding, the paper's
QUERY_POINTS = 80_000  # the paper's

OVERLAP_TERMS = ("shared", "as_printed")


@dataclass(frozen=True)
class Lattice:
    """Query points on a regular lattice: origin `(3,)`, spacing in metres, shape `(X, Y, Z)`, z fastest.

    inside : flat bool, which points count, or None where all do.
    """

    origin: Tensor
    spacing: float
    shape: tuple[int, int, int]
    inside: Tensor | None

    @property
    def count(self) -> int:
        """How many points count."""
        if self.inside is None:
            return self.shape[0] * self.shape[1] * self.shape[2]
        return int(self.inside.sum())

    def points(self) -> Tensor:
        """All points, `(X * Y * Z, 3)`, those that do not count included."""
        axes = [torch.arange(n, device=self.origin.device) for n in self.shape]
        index = torch.stack(torch.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
        return self.origin + index.to(self.origin.dtype) * self.spacing

    def shifted(self, share: Tensor) -> Lattice:
        """The lattice moved by `share` `(3,)` of its spacing; the same points count."""
        return Lattice(self.origin + share * self.spacing, self.spacing, self.shape, self.inside)


def query_lattice(container: Container, count: int = QUERY_POINTS, device="cpu", dtype=torch.float32) -> Lattice:
    """About `count` lattice points in the container. Raises InputError where count is not positive."""
    if count < 1:
        raise InputError(f"at least one query point is needed, got {count}")
    spacing = (container.volume / count) ** (1 / 3)
    low, high = (torch.as_tensor(corner, device=device, dtype=dtype) for corner in container.bounds)
    shape = [max(1, round(float(edge) / spacing)) for edge in high - low]
    steps = torch.tensor(shape, device=device, dtype=dtype) - 1
    lattice = Lattice((low + high) / 2 - steps * spacing / 2, spacing, tuple(shape), None)
    if container.size is not None:
        return lattice
    return Lattice(lattice.origin, spacing, lattice.shape, container.signed_distance(lattice.points())[0] < 0)


def silhouette(images: Tensor, targets: Tensor, softness_px: float = 0.0) -> Tensor:
    """Eq. 2: `1/(M N K) sum_k sum_pixels (I_k - rendered_k)^2` over images `(..., K, M, N)`, targets `(K, M, N)`.

    softness_px blurs the difference, so that a contour feels a target some pixels away; both sides alike, so that
    a perfect match stays the minimum.
    """
    return _Silhouette.apply(images, targets, softness_px)


class _Silhouette(torch.autograd.Function):
    """The blur is its own adjoint: the way back is one more blur."""

    @staticmethod
    def forward(ctx, images, targets, softness_px):
        soft = silhouettes.soften(images - targets, softness_px)
        ctx.save_for_backward(soft)
        ctx.softness_px = softness_px
        return soft.square().mean((-1, -2, -3))

    @staticmethod
    def backward(ctx, upstream):
        (soft,) = ctx.saved_tensors
        upstream = upstream[..., None, None, None] * 2 / soft.shape[-3:].numel()
        return upstream * silhouettes.soften(soft, ctx.softness_px), None, None


def overlap(
    stack: GridStack, half: Tensor, rotation: Tensor, translation: Tensor, lattice: Lattice, term: str = "shared"
) -> Tensor:
    """Eq. 3-4: `L_is = sum_p D(p)`, `D(p) = sum over {i : S_i(p) < 0} of -S_i(p)`, metres.

    half : `(N, 3)` half extents of the bodies' boxes, centred in their frames.
    term : "shared" (the kit's reading, the paper's words): only points that lie inside two or more bodies count.
        "as_printed" (the letter of Eq. 3): all points inside any body count; it repels nothing, see the design.
    Raises InputError for another term.
    """
    if term not in OVERLAP_TERMS:
        raise InputError(f"overlap term {term!r} is unknown; use one of {', '.join(OVERLAP_TERMS)}")
    if dispatch.compiled(rotation.device):
        sums = _compiled_overlap(stack, half, rotation, translation, lattice, 2 if term == "shared" else 1)
        turn = wrenches.arrays(rotation, translation)[0]
        sums[..., 1:] = (sums[..., 1:].reshape(*turn.shape[:2], 4, 3) @ turn.swapaxes(2, 3)).reshape(
            *turn.shape[:2], 12
        )
        return wrenches.attach_sums(sums, rotation, translation)
    if rotation.dim() == 4:
        each = zip(rotation, translation, strict=True)
        return torch.stack([overlap(stack, half, *place, lattice, term) for place in each])
    with torch.no_grad():
        body, point, local = _inside_pairs(stack, half, rotation, translation, lattice, shared=term == "shared")
        value, slope = stack.sample(body, local)
        counts = value < 0
        if term == "shared":
            counts &= _tally(point[counts], lattice)[point] >= 2
        kept = counts.nonzero()[:, 0]
        wrench = wrenches.gather(len(rotation), body[kept], local[kept], slope[kept])
        total = -value[kept].sum()
        gradients = wrenches.gradients(wrenches.to_world(wrench, rotation))
    return wrenches.attach(total, rotation, translation, *gradients)


def occupancy(stack: GridStack, half: Tensor, rotation: Tensor, translation: Tensor, lattice: Lattice) -> Tensor:
    """How many bodies each lattice point lies in, `(X, Y, Z)`; rotation `(N, 3, 3)`, translation `(N, 3)`."""
    if dispatch.compiled(rotation.device):
        counts = _compiled_counts(_for_kernels(stack, half, rotation, translation, lattice), 1, lattice)
        return torch.from_numpy(counts[0].reshape(lattice.shape))
    with torch.no_grad():
        body, point, local = _inside_pairs(stack, half, rotation, translation, lattice, shared=False)
        return _tally(point[stack.sample(body, local)[0] < 0], lattice).view(lattice.shape)


def _compiled_overlap(stack, half, rotation, translation, lattice, need: int) -> np.ndarray:
    """`overlap` by compiled loops, `(S, N, 13)`: the bodies' shares of its value, and the wrenches in their frames."""
    from .kernels import grid

    scene, starts = _for_kernels(stack, half, rotation, translation, lattice), rotation.shape[:-3].numel()
    if need > 1:
        counts = _compiled_counts(scene, starts, lattice)
    else:
        counts = np.ones((starts, math.prod(lattice.shape)), np.int16)
    sums = np.zeros((starts, len(half), 13))
    dispatch.share(grid.overlap, need, counts, *scene, sums)
    return sums


def _compiled_counts(scene: tuple, starts: int, lattice: Lattice) -> np.ndarray:
    """How many bodies of each start the flat lattice points are in, `(S, P)`."""
    from .kernels import grid

    counts = np.zeros((dispatch.workers(), starts, math.prod(lattice.shape)), np.int16)
    dispatch.share(grid.count, *scene, counts)
    return counts.sum(0, np.int16)


def _for_kernels(stack, half, rotation, translation, lattice) -> tuple:
    """What both loops of the overlap term are given."""
    return (
        stack.arrays,
        half.numpy(),
        *wrenches.arrays(rotation, translation),
        np.array([*lattice.origin.tolist(), lattice.spacing]),
        lattice.shape,
        np.zeros(0, np.bool_) if lattice.inside is None else lattice.inside.numpy(),
    )


def extrusion(
    container: Container,
    vertices: Tensor,
    vertex_body: Tensor,
    radius: Tensor,
    rotation: Tensor,
    translation: Tensor,
    epsilon: float = EPSILON,
) -> Tensor:
    """Eq. 5: `L_ext = sum_i sum_{v in V_i} max(-epsilon, S_C(v))`, metres.

    vertices `(V, 3)` in body frames, vertex_body `(V,)` sorted, radius `(N,)` of the bodies' bounding spheres. Bodies
    whose spheres lie deeper than epsilon add their constant -epsilon for each vertex without being looked at.
    """
    if dispatch.compiled(rotation.device):
        from .kernels import surface

        place = wrenches.arrays(rotation, translation)
        sums = np.zeros((*place[1].shape[:2], 13))
        dispatch.share(
            surface.extrusion,
            container.arrays(rotation.dtype),
            vertices.numpy(),
            np.searchsorted(vertex_body.numpy(), np.arange(len(radius) + 1)),
            radius.numpy(),
            *place,
            epsilon,
            sums,
        )
        return wrenches.attach_sums(sums, rotation, translation)
    if rotation.dim() == 4:
        each = zip(rotation, translation, strict=True)
        return torch.stack([extrusion(container, vertices, vertex_body, radius, *place, epsilon) for place in each])
    with torch.no_grad():
        near = container.signed_distance(translation)[0] + radius > -epsilon
        chosen = near[vertex_body].nonzero()[:, 0]
        body, point = vertex_body[chosen], vertices[chosen]
        value, normal = container.signed_distance(to_world(rotation, translation, body, point))
        out = (value > -epsilon).nonzero()[:, 0]
        total = value[out].sum() - epsilon * (len(vertices) - len(out))
        gradients = wrenches.gradients(wrenches.gather(len(rotation), body[out], point[out], normal[out]))
    return wrenches.attach(total, rotation, translation, *gradients)


def runs(start: Tensor, count: Tensor) -> tuple[Tensor, Tensor]:
    """Rows of index ranges `[start, start + count)`: which range each index is of, and the index."""
    which = torch.repeat_interleave(count)
    return which, torch.arange(len(which), device=count.device) - (count.cumsum(0) - count - start)[which]


def to_world(rotation: Tensor, translation: Tensor, body: Tensor, points: Tensor) -> Tensor:
    """Points `(M, 3)` in the frames of `body` `(M,)` -> world."""
    return (rotation[body] @ points[:, :, None])[:, :, 0] + translation[body]


def _tally(point: Tensor, lattice: Lattice) -> Tensor:
    size = lattice.shape[0] * lattice.shape[1] * lattice.shape[2]
    ones = torch.ones_like(point, dtype=torch.int32)
    return torch.zeros(size, dtype=torch.int32, device=point.device).index_add_(0, point, ones)


def _inside_pairs(stack, half, rotation, translation, lattice, shared: bool):
    """Pairs (body, lattice point) that may lie inside: body `(M,)`, flat point `(M,)`, place in the body's frame.

    A body's box is cut out of the lattice column by column, so that a turned box costs its own volume and not that
    of the upright box about it. The grids' nearest values throw out what surely lies outside; with `shared`, also
    points that are left with one body.
    """
    device, h = rotation.device, lattice.spacing
    reach = (rotation.abs() @ half[:, :, None])[:, :, 0]
    top = torch.tensor(lattice.shape, device=device) - 1
    low = torch.minimum(((translation - reach - lattice.origin) / h).ceil().clamp(min=0).long(), top + 1)
    high = torch.minimum(((translation + reach - lattice.origin) / h).floor().long(), top)
    width = (high - low + 1).clamp(min=0)

    columns = width[:, 0] * width[:, 1]
    body, step = runs(torch.zeros_like(columns), columns)
    ix = low[body, 0] + torch.div(step, width[body, 1], rounding_mode="floor")
    iy = low[body, 1] + step % width[body, 1]
    # along a column the place in the body's frame is base + iz * rise
    foot = torch.stack([ix, iy, torch.zeros_like(ix)], 1).to(rotation.dtype) * h + lattice.origin - translation[body]
    base = (foot[:, None, :] @ rotation[body])[:, 0]
    rise = (rotation[:, 2] * h)[body]
    rise = torch.where(rise.abs() < 1e-12, 1e-12, rise)
    bound = half[body]
    enter, leave = (-bound - base) / rise, (bound - base) / rise
    first = torch.minimum(enter, leave).amax(1).ceil().clamp(min=0).long()
    last = torch.minimum(torch.maximum(enter, leave).amin(1).floor().clamp(-1, lattice.shape[2]).long(), top[2])
    lengths = (last - first + 1).clamp(min=0)

    column, iz = runs(first, lengths)
    owner = body[column]
    point = ((ix * lattice.shape[1] + iy) * lattice.shape[2])[column] + iz
    spacing = stack.spacing[body, None]
    cell = ((base - stack.origin[body]) / spacing)[column] + iz[:, None] * (rise / spacing)[column]
    value = stack.at_cells(owner, cell)
    kept = value < NEAR * stack.spacing[owner]
    if lattice.inside is not None:
        kept &= lattice.inside[point]
    if shared:
        kept &= _tally(point[kept], lattice)[point] >= 2
    kept = kept.nonzero()[:, 0]
    column, owner, point, iz = column[kept], owner[kept], point[kept], iz[kept]
    return owner, point, base[column] + iz[:, None] * rise[column]
