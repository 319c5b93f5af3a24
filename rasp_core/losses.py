"""The paper's losses, each with its equation.

    L_total = L_sil + L_is + lambda * L_ext          (Eq. 1)

All take rotations `(N, 3, 3)` and translations `(N, 3)` and are differentiable in them (along rotations); with those of
S starts, `(S, N, 3, 3)` and `(S, N, 3)`, they give a value for each start. An object is looked up only at the points in
its own bounding box, never objects x points.
"""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor

from . import silhouettes
from .geometry.containers import Container
from .geometry.sdf import GridStack
from .kernels import dispatch, wrenches
from .poses import to_world
from .query_points import Lattice, counts_by_compiled_loops, for_kernels, inside_pairs, tally
from .util.errors import InputError

LAMBDA = 0.001  # weight of the extrusion term, the paper's
EPSILON = 0.01  # metres; how deep inside the container the extrusion term stops rewarding, the paper's

OVERLAP_TERMS = ("shared", "as_printed")


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
        body, point, local = inside_pairs(stack, half, rotation, translation, lattice, shared=term == "shared")
        value, slope = stack.sample(body, local)
        counts = value < 0
        if term == "shared":
            counts &= tally(point[counts], lattice)[point] >= 2
        kept = counts.nonzero()[:, 0]
        wrench = wrenches.gather(len(rotation), body[kept], local[kept], slope[kept])
        total = -value[kept].sum()
        gradients = wrenches.gradients(wrenches.to_world(wrench, rotation))
    return wrenches.attach(total, rotation, translation, *gradients)


def _compiled_overlap(stack, half, rotation, translation, lattice, need: int) -> np.ndarray:
    """`overlap` by compiled loops, `(S, N, 13)`: the bodies' shares of its value, and the wrenches in their frames."""
    from .kernels import grid

    scene, starts = for_kernels(stack, half, rotation, translation, lattice), rotation.shape[:-3].numel()
    if need > 1:
        counts = counts_by_compiled_loops(scene, starts, lattice)
    else:
        counts = np.ones((starts, math.prod(lattice.shape)), np.int16)
    sums = np.zeros((starts, len(half), 13))
    dispatch.share(grid.overlap, need, counts, *scene, sums)
    return sums


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
