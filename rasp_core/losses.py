"""The paper's losses, Eq. 2 to 5; `objective` is their weighted sum, Eq. 1.

All take rotations `(N, 3, 3)` and translations `(N, 3)` and are differentiable in them (along rotations); with those of
S starts, `(S, N, 3, 3)` and `(S, N, 3)`, they give a value for each start. Each is written twice: in plain torch, where
the equation can be read, and by compiled loops; `wrenches.loss` chooses.
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
from .query_points import Lattice, bodies_at, for_kernels, occupancy_by_compiled_loops, possibly_inside
from .util import capacity
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
    """Eq. 4: `L_is = sum_p D(p)`, the depths of Eq. 3 summed over all query points, metres.

    half : `(N, 3)` half extents of the bodies' boxes, centred in their frames.
    term : "shared", the kit's reading and the paper's words: only points that lie inside two or more bodies count.
        "as_printed", the letter of Eq. 3: points inside one body count as well. It repels nothing: a rigid body has
        the same depth wherever it lies, whether another one is there or not, so that the sum hardly changes with the
        poses, and what is left of the gradient is the lattice's noise.
    Raises InputError for another term.
    """
    if term not in OVERLAP_TERMS:
        raise InputError(f"overlap term {term!r} is unknown; use one of {', '.join(OVERLAP_TERMS)}")
    least = 2 if term == "shared" else 1

    @wrenches.each_start
    def plain(rotation, translation):
        body, point, depth, slope = depths(stack, half, rotation, translation, lattice, least)
        wrench = wrenches.gather(len(rotation), body, point, slope)
        return depth.sum(), wrenches.to_world(wrench, rotation)

    def compiled(rotation, translation):
        return _overlap_by_compiled_loops(stack, half, rotation, translation, lattice, least)

    return wrenches.loss(rotation, translation, compiled, plain)


def depths(
    stack: GridStack, half: Tensor, rotation: Tensor, translation: Tensor, lattice: Lattice, least: int = 2
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Eq. 3: the terms of `D(p) = sum over {i : S_i(p) < 0} of -S_i(p)` at all query points p that lie in at least
    `least` bodies, with S_i the signed distance of body i.

    Returns for each term the body i `(M,)`, p in its frame `(M, 3)`, the depth -S_i(p) `(M,)` in metres, and the slope
    of S_i there `(M, 3)`, in its frame. What is there to fill a `util.capacity` has no depth and no slope.
    """
    body, point, local, real = possibly_inside(stack, half, rotation, translation, lattice, least)
    distance, slope = stack.sample(body, local)
    counts = capacity.only(real, distance < 0)
    if least > 1:
        counts &= bodies_at(point, counts, lattice)[point] >= least
    kept, real = capacity.found(counts, "lattice points of Eq. 3")
    return body[kept], local[kept], capacity.only(real, -distance[kept]), capacity.only(real, slope[kept])


def _overlap_by_compiled_loops(stack, half, rotation, translation, lattice, least: int) -> np.ndarray:
    """Eq. 3-4 as sums `(S, N, 13)`, see `wrenches.loss`: one pass counts the bodies at each point, one adds depths."""
    from .kernels import overlap as loops

    scene, starts = for_kernels(stack, half, rotation, translation, lattice), len(rotation)
    if least > 1:
        counts = occupancy_by_compiled_loops(scene, starts, lattice)
    else:
        counts = np.ones((starts, math.prod(lattice.shape)), np.int16)
    sums = np.zeros((*translation.shape[:2], 13))
    dispatch.in_parallel(loops.overlap, least, counts, *scene, sums)
    wrench = sums[..., 1:].reshape(*translation.shape[:2], 4, 3) @ rotation.swapaxes(2, 3)
    sums[..., 1:] = wrench.reshape(*translation.shape[:2], 12)
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
    """Eq. 5: `L_ext = sum_i sum_{v in V_i} max(-epsilon, S_C(v))`, metres, with S_C the container's signed distance.

    vertices `(V, 3)` in body frames, vertex_body `(V,)` sorted, radius `(N,)` of the bodies' bounding spheres. Bodies
    whose spheres lie deeper than epsilon add their constant -epsilon for each vertex without being looked at.
    """

    @wrenches.each_start
    def plain(rotation, translation):
        near = container.signed_distance(translation)[0] + radius > -epsilon
        chosen, real = capacity.found(near[vertex_body], "vertices near walls")
        body, point = vertex_body[chosen], vertices[chosen]
        distance, normal = container.signed_distance(to_world(rotation, translation, body, point))
        beyond = capacity.only(real, (distance + epsilon).clamp(min=0))
        force = torch.where((beyond > 0)[:, None], normal, 0)
        return beyond.sum() - epsilon * len(vertices), wrenches.gather(len(rotation), body, point, force)

    def compiled(rotation, translation):
        from .kernels import contact as loops

        first = np.searchsorted(vertex_body.numpy(), np.arange(len(radius) + 1))
        wall, corners, spheres = container.arrays(vertices.dtype), vertices.numpy(), radius.numpy()
        sums = np.zeros((*translation.shape[:2], 13))
        dispatch.in_parallel(loops.extrusion, wall, corners, first, spheres, rotation, translation, epsilon, sums)
        return sums

    return wrenches.loss(rotation, translation, compiled, plain)
