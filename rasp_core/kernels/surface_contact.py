"""Surface contact: the kit's own term, which sees overlaps thinner than the spacing of Eq. 4's query points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ..geometry.containers import Container
from ..geometry.sdf import NEAR, GridStack
from ..geometry.surface_samples import SurfaceSamples
from ..util import capacity
from . import dispatch, wrenches

CHUNKS = 8  # that the compiled loops do one by one, so that the sums do not depend on the number of threads


@dataclass(frozen=True)
class Neighbours:
    """Samples that may come to touch, rows (sample, the body it lies on, the body it may meet) of int32: `touching`
    `(M, 3)`, and `by_wall` `(W, 3)` with -1 for the wall. Body i of start s is `s * N + i`."""

    touching: Tensor
    by_wall: Tensor


def neighbours(
    stack: GridStack,
    samples: SurfaceSamples,
    half: Tensor,
    rotation: Tensor,
    translation: Tensor,
    container: Container,
    reach: float,
    movers: int | None = None,
) -> Neighbours:
    """Every surface sample within `reach` metres of another body, or of the container's wall, or beyond it.

    movers : only the first so many bodies move, all where None; what the others have among themselves is left out.

    Good for as long as nothing moves by more than half of `reach` less twice the margin that `contact` is given.
    """
    movers = len(half) if movers is None else movers
    search = _neighbours_by_compiled_loops if dispatch.compiled(rotation.device) else _neighbours
    return search(stack, samples, half, rotation, translation, container, reach, movers)


def _neighbours(stack, samples, half, rotation, translation, container, reach, movers) -> Neighbours:
    bodies = len(half)
    with torch.no_grad():
        rotation, translation = rotation.reshape(-1, 3, 3), translation.reshape(-1, 3)
        again = torch.arange(len(rotation), device=rotation.device) % bodies
        first, second = _touching_boxes(half[again], rotation, translation, bodies, reach).nonzero(as_tuple=True)
        moves = again < movers
        first, second = first[moves[first] | moves[second]], second[moves[first] | moves[second]]
        pair, sample, _ = capacity.ranges(samples.start[again[first]], samples.count[again[first]], "samples")
        # the sampled body seen from the other's frame
        back = rotation[second].transpose(1, 2)
        turn, shift = back @ rotation[first], (back @ (translation[first] - translation[second])[:, :, None])[:, :, 0]
        local = (turn[pair] @ samples.points[sample][:, :, None])[:, :, 0] + shift[pair]
        other = second[pair]
        upright = (rotation[other].abs() @ half[again[other]][:, :, None])[:, :, 0]
        offset = _placed(rotation, translation, first[pair], samples.points[sample]) - translation[other]
        within = (local.abs() < half[again[other]] + reach) & (offset.abs() < upright + reach)
        near = within.all(1).nonzero()[:, 0]
        pair, sample, local, other = pair[near], sample[near], local[near], other[near]
        distance = stack.nearest(again[other], local)
        near = (distance < reach + NEAR * stack.spacing[again[other]]).nonzero()[:, 0]
        touching = torch.stack([sample[near], first[pair[near]], other[near]], 1)

        close = container.signed_distance(translation)[0] + half.norm(dim=1)[again] > -reach
        close &= moves
        own, sample, _ = capacity.ranges(
            samples.start[again], torch.where(close, samples.count[again], 0), "samples by walls"
        )
        distance, _ = container.signed_distance(_placed(rotation, translation, own, samples.points[sample]))
        near = (distance > -reach).nonzero()[:, 0]
        by_wall = torch.stack([sample[near], own[near], torch.full_like(near, -1)], 1)
    return Neighbours(touching.int(), by_wall.int())


def _neighbours_by_compiled_loops(stack, samples, half, rotation, translation, container, reach, movers) -> Neighbours:
    from . import contact as loops

    wall, points = container.arrays(rotation.dtype), samples.points.numpy()
    first = np.append(samples.start.numpy(), len(points))
    turns, places = wrenches.arrays(rotation, translation)

    def search(worker: int, workers: int) -> dict:
        return {
            chunk: loops.neighbours(
                chunk, CHUNKS, wall, stack.arrays, half.numpy(), turns, places, points, first, reach, movers
            )
            for chunk in range(worker, CHUNKS, workers)
        }

    found = {chunk: rows for part in dispatch.in_parallel(search) for chunk, rows in part.items()}
    touching, by_wall = zip(*(found[chunk] for chunk in range(CHUNKS)), strict=True)
    return Neighbours(torch.from_numpy(np.concatenate(touching)), torch.from_numpy(np.concatenate(by_wall)))


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
    the distance that each body keeps: from a wall its own, from another body the sum of both. With S starts, a value
    for each.
    """

    def plain(rotation, translation):
        return _contact(stack, samples, near, container, rotation, translation, margin)

    def compiled(rotation, translation):
        from . import contact as loops

        wall, points, area = container.arrays(samples.points.dtype), samples.points.numpy(), samples.area.numpy()
        sums = np.zeros((CHUNKS, translation.shape[0] * translation.shape[1], 13))
        for rows in (near.touching.numpy(), near.by_wall.numpy()):
            dispatch.in_parallel(
                loops.contact, wall, stack.arrays, points, area, rotation, translation, margin.numpy(), rows, sums
            )
        return sums.sum(0)

    return wrenches.loss(rotation, translation, compiled, plain)


def _contact(stack, samples, near, container, rotation, translation, margin) -> tuple[Tensor, Tensor]:
    """Values `(S,)` and wrenches `(S, N, 4, 3)` of `contact`, for S starts."""
    starts, bodies = translation.shape[:2]
    turn, place = rotation.reshape(-1, 3, 3), translation.reshape(-1, 3)
    sample, own, other = near.touching.long().unbind(1)
    point = samples.points[sample]
    local = ((_placed(turn, place, own, point) - place[other])[:, None, :] @ turn[other])[:, 0]
    distance, slope = stack.sample(other % bodies, local)
    depth = (margin[own % bodies] + margin[other % bodies] - distance).clamp(min=0)
    push = samples.area[sample] * depth
    total = torch.zeros(len(turn), dtype=push.dtype, device=push.device).index_add_(0, own, push * depth)
    force = 2 * push[:, None] * (turn[other] @ slope[:, :, None])[:, :, 0]
    wrench = wrenches.gather(len(turn), own, point, -force) + wrenches.gather(len(turn), other, local, force)

    sample, own, _ = near.by_wall.long().unbind(1)
    point = samples.points[sample]
    distance, normal = container.signed_distance(_placed(turn, place, own, point))
    depth = (distance + margin[own % bodies]).clamp(min=0)
    push = samples.area[sample] * depth
    total.index_add_(0, own, push * depth)
    wrench += wrenches.gather(len(turn), own, point, 2 * push[:, None] * normal)
    return total.view(starts, bodies).sum(-1), wrench.view(starts, bodies, 4, 3)


def _touching_boxes(half: Tensor, rotation: Tensor, translation: Tensor, bodies: int, margin: float) -> Tensor:
    """`(S * N, S * N)` bool, which world boxes, grown by `margin` metres in all, intersect; False on the diagonal and
    between starts, each of them `bodies` in a row."""
    reach = (rotation.abs() @ half[:, :, None])[:, :, 0] + margin / 2
    apart = (translation[:, None] - translation[None]).abs() > reach[:, None] + reach[None]
    start = torch.arange(len(half), device=half.device) // bodies
    touching = ~apart.any(-1) & (start[:, None] == start[None])
    return touching.fill_diagonal_(False)


def _placed(rotation: Tensor, translation: Tensor, body: Tensor, points: Tensor) -> Tensor:
    """Points `(M, 3)` in the frames of `body` `(M,)`, in the world."""
    return (rotation[body] @ points[:, :, None])[:, :, 0] + translation[body]
