"""Surface contact: the kit's own term, which sees overlaps thinner than the spacing of Eq. 4's query points."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from . import forces
from .containers import Container
from .losses import runs, to_world
from .sdf import NEAR, GridStack


@dataclass(frozen=True)
class SurfaceSamples:
    """Points on the bodies' surfaces: points `(S, 3)` in body frames, body by body; count and start `(N,)`;
    area `(S,)` square metres that each stands for."""

    points: Tensor
    start: Tensor
    count: Tensor
    area: Tensor


@dataclass(frozen=True)
class Neighbours:
    """Samples that may come to touch: sample `(M,)`, the body it lies on, the body it may meet; and for walls,
    wall_sample `(W,)` and its body."""

    sample: Tensor
    own: Tensor
    other: Tensor
    wall_sample: Tensor
    wall_own: Tensor


def neighbours(
    stack: GridStack,
    samples: SurfaceSamples,
    half: Tensor,
    rotation: Tensor,
    translation: Tensor,
    container: Container,
    reach: float,
) -> Neighbours:
    """Every surface sample within `reach` metres of another body, or of the container's wall, or beyond it.

    Good for as long as nothing moves by more than half of `reach` less twice the margin that `contact` is given.
    """
    with torch.no_grad():
        first, second = _touching_boxes(half, rotation, translation, reach).nonzero(as_tuple=True)
        pair, sample = runs(samples.start[first], samples.count[first])
        # the sampled body seen from the other's frame
        back = rotation[second].transpose(1, 2)
        turn, shift = back @ rotation[first], (back @ (translation[first] - translation[second])[:, :, None])[:, :, 0]
        local = (turn[pair] @ samples.points[sample][:, :, None])[:, :, 0] + shift[pair]
        other = second[pair]
        near = (local.abs() < half[other] + reach).all(1).nonzero()[:, 0]
        pair, sample, local, other = pair[near], sample[near], local[near], other[near]
        near = (stack.nearest(other, local) < reach + NEAR * stack.spacing[other]).nonzero()[:, 0]

        close = container.signed_distance(translation)[0] + half.norm(dim=1) > -reach
        own, wall = runs(samples.start, torch.where(close, samples.count, 0))
        distance, _ = container.signed_distance(to_world(rotation, translation, own, samples.points[wall]))
        by_wall = (distance > -reach).nonzero()[:, 0]
    return Neighbours(sample[near], first[pair[near]], other[near], wall[by_wall], own[by_wall])


def contact(
    stack: GridStack,
    samples: SurfaceSamples,
    near: Neighbours,
    container: Container,
    rotation: Tensor,
    translation: Tensor,
    margin: Tensor,
) -> Tensor:
    """`sum over surface samples of area * depth^2`, depth = how much nearer than allowed to a body or wall; m^4.

    The kit's own term. Overlaps thinner than the spacing of the query points are invisible to Eq. 4; the samples of
    each body, looked up in its neighbours' and the container's signed distances, see them. margin `(N,)` metres,
    the distance that each body keeps: from a wall its own, from another body the sum of both.
    """
    with torch.no_grad():
        point = samples.points[near.sample]
        world = to_world(rotation, translation, near.own, point)
        local = ((world - translation[near.other])[:, None, :] @ rotation[near.other])[:, 0]
        value, slope = stack.sample(near.other, local)
        depth = (margin[near.own] + margin[near.other] - value).clamp(min=0)
        push = samples.area[near.sample] * depth
        total = (push * depth).sum()
        force = 2 * push[:, None] * (rotation[near.other] @ slope[:, :, None])[:, :, 0]
        wrench = forces.gather(len(rotation), near.own, point, -force)
        wrench += forces.gather(len(rotation), near.other, local, force)

        point = samples.points[near.wall_sample]
        value, normal = container.signed_distance(to_world(rotation, translation, near.wall_own, point))
        depth = (value + margin[near.wall_own]).clamp(min=0)
        push = samples.area[near.wall_sample] * depth
        total += (push * depth).sum()
        wrench += forces.gather(len(rotation), near.wall_own, point, 2 * push[:, None] * normal)
    return forces.attach(total, rotation, translation, *forces.gradients(wrench))


def _touching_boxes(half: Tensor, rotation: Tensor, translation: Tensor, margin: float) -> Tensor:
    """`(N, N)` bool, which bodies' world boxes, grown by `margin` metres in all, intersect; False on the diagonal."""
    reach = (rotation.abs() @ half[:, :, None])[:, :, 0] + margin / 2
    apart = (translation[:, None] - translation[None]).abs() > reach[:, None] + reach[None]
    touching = ~apart.any(-1)
    return touching.fill_diagonal_(False)
