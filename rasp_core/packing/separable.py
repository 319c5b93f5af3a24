"""Packings that come apart through the open top by straight pulls: whatever a search found, made so.

What locks is taken out, the least volume that is found; what was over, and all else that is, is then dropped from above
where there is room, so that it comes out first. Where all objects are to be in the smallest box, that grows for them.
`exact.pulls` judges all anew.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import torch

from ..exact.pulls import Dismantling, Ways, follow, opening, take_apart
from ..geometry.containers import Container, FreeBox
from ..geometry.growing import shrunk_shape
from ..geometry.meshes import Body
from ..geometry.zones import box_of
from ..poses import from_matrices
from ..util.errors import InputError
from .clearance import Clearance
from .closing_up import closed_up
from .compaction import MOST_BODIES
from .dropping import drop
from .enclosing_box import enclosing_box
from .pool import Worth
from .result import Packing, finish_anew

AGAIN = 3  # times at most that more is taken out and dropped
TRIES = 8  # of what to take out, all but the first by chance
SPREAD = 0.5  # of the logarithm of what chance makes of a choice's worth
CLOSED = (
    "not one object can be pulled straight out through the container's top, its highest plane; leave out --separable, "
    "or give a container that is open there"
)
RANKED = 1e4  # an object is worth so many times one of its volume that ranks below it


def check_open(bodies: Sequence[Body], container: Container | FreeBox) -> None:
    """Raise InputError if the container's opening is surely too small for each of the bodies: some section of a body,
    across any direction, has no less area than its volume over its diameter."""
    if isinstance(container, Container) and opening(container) < min(b.volume / (2 * b.radius) for b in bodies):
        raise InputError(CLOSED)


def made_separable(
    packed: Packing,
    pool: Sequence[Body],
    container: Container | FreeBox,
    clearance: Clearance | None = None,
    most: int | None = None,
    device: str | torch.device = "cpu",
    late: Callable[[], bool] = lambda: False,
    again: int = AGAIN,
) -> Packing:
    """The packing, or as much of it as comes apart and what is dropped on that, certified anew; `dismantling` says how.

    pool : that `packed.chosen` counts, of which fixed bodies stay and are in the way. container : that was asked for.
    clearance : of the pool. most : objects, at most. late : whether time is over, in which a box to be found is closed
    up again. again : times that what is dropped may lock something, as where a box grows and a slanted way meets its
    wall. A packing that comes apart, or does not hold, keeps its poses.
    Raises InputError if not one object comes out through the top, however few there are.
    """
    ways = Ways(packed.bodies, packed.matrices, packed.container)
    found = packed.dismantling or take_apart(ways)
    if found.holds or not packed.certificate.holds:
        return replace(packed, dismantling=found)
    names = [body.name for body in packed.bodies]
    locked = [names.index(name) for name in found.stuck]
    worth = Worth(pool)
    weight = worth.volumes * RANKED ** worth.rank.clip(max=60)
    out = locking(ways, locked, weight[packed.chosen])
    kept = [i for i in range(len(names)) if i not in out]
    if not any(ways.movable[kept]):
        raise InputError(CLOSED)
    chosen, matrices, room = [packed.chosen[i] for i in kept], packed.matrices[kept], packed.container
    over = [i for i, body in enumerate(pool) if i not in set(chosen) and not body.wishes.fixed]
    free = container if isinstance(container, FreeBox) else None
    dropped, matrices, room = drop(pool, over, chosen, matrices, room, clearance, free)
    if most is not None:
        dropped = dropped[: most - len(chosen)]

    def finished(more: Sequence[tuple[int, np.ndarray]]) -> Packing:
        order = sorted([*zip(chosen, matrices, strict=True), *more], key=lambda one: pool[one[0]].wishes.fixed)
        indices, placed = [i for i, _ in order], np.array([matrix for _, matrix in order])
        return proven(indices, placed, room.base.size)

    def proven(indices: list[int], placed: np.ndarray, edges: np.ndarray | None) -> Packing:
        bodies, about = [pool[i] for i in indices], room
        poses = from_matrices(bodies, placed)
        if free is not None:
            wall = 0.0 if clearance is None else clearance.wall
            floor = edges - 2 * wall if free.zones else None
            closest, poses = enclosing_box(bodies, poses, shrunk_shape(free, wall), floor)
            about = box_of(free, closest.base.size + 2 * wall)
        again = finish_anew(packed, pool, indices, poses, about, device, clearance)
        left_out = [pool[i].name for i in packed.chosen if i not in set(indices)]
        return replace(again, dismantling=take_apart(Ways(again.bodies, again.matrices, again.container), left_out))

    whole = finished(dropped)
    if whole.certificate.holds and whole.dismantling.stuck and again:
        whole = made_separable(whole, pool, container, clearance, most, device, lambda: True, again - 1)
    if not _held(whole):
        return finished([])  # voxels let something through, which is rare
    if free is None or len(whole.chosen) > MOST_BODIES:
        return whole
    of_these = None if clearance is None else Clearance(clearance.parts[whole.chosen], clearance.wall)
    tighter = closed_up(whole.bodies, whole.matrices, free, whole.container.base.size, of_these, late)
    closed = whole if tighter is None else proven(whole.chosen, *tighter)
    return closed if _held(closed) else whole


def _held(packed: Packing) -> bool:
    return packed.certificate.holds and packed.dismantling.holds


def locking(ways: Ways, locked: Sequence[int], weight: np.ndarray) -> set[int]:
    """Of bodies that lock each other, some without which the others come out, of the least `weight` `(N,)` that is
    found."""
    locked = list(locked)
    weight = weight[locked]
    ends = np.flatnonzero(~ways.movable)
    count, directions = len(locked), len(ways.directions)
    blocked = np.zeros((directions, count, count), bool)
    closed = np.zeros((directions, count), bool)
    for k in range(directions):
        for a, i in enumerate(locked):
            closed[k, a] = np.isinf(ways.wall(k, i)) or ways.blocked(k, i, ends).any()
            if not closed[k, a]:
                blocked[k, a] = ways.blocked(k, i, locked)

    def stuck(there: np.ndarray) -> np.ndarray:
        there = there.copy()
        while True:
            free = there & (~closed & ~(blocked & there).any(2)).any(0)
            if not free.any():
                return there
            there &= ~free

    random, best = np.random.default_rng(0), np.ones(count, bool)
    for attempt in range(TRIES):
        chance = np.exp(SPREAD * random.standard_normal(count)) if attempt else np.ones(count)
        out = _chosen_out(stuck, blocked, closed, weight, chance)
        for a in sorted(np.flatnonzero(out), key=lambda a: -weight[a]):  # what need not have gone comes back
            without = out.copy()
            without[a] = False
            if not stuck(~without).any():
                out = without
        if weight[out].sum() < weight[best].sum():
            best = out
    return {locked[a] for a in np.flatnonzero(best)}


def _chosen_out(stuck, blocked: np.ndarray, closed: np.ndarray, weight: np.ndarray, chance: np.ndarray) -> np.ndarray:
    """Bodies to take out, one after the other that which frees most for its weight; `(N,)` bool."""
    out = np.zeros(len(weight), bool)
    while (left := stuck(~out)).any():
        freed = {}
        for a in np.flatnonzero(left):
            after = left.copy()
            after[a] = False
            freed[a] = weight[after].sum() - weight[stuck(after)].sum()
        a = max(freed, key=lambda a: chance[a] * freed[a] / weight[a])
        if freed[a] > 0:
            out[a] = True
            continue
        # none alone frees another: all that is in the way of one, where that is least, or what has no way at all
        in_the_way = np.where(closed, np.inf, (blocked & left) @ weight)[:, left]
        k, b = np.unravel_index(int((in_the_way / chance[left]).argmin()), in_the_way.shape)
        which = np.flatnonzero(left)[b]
        if np.isinf(in_the_way[k, b]):
            out |= left
        elif in_the_way[k, b] < weight[which]:
            out |= blocked[k, which] & left
        else:
            out[which] = True
    return out


def proven_again(
    bodies: Sequence[Body], matrices: np.ndarray, container: Container, record: dict, wanted: bool = False
) -> Dismantling | None:
    """How bodies come apart by the order that a run's result.json has, judged anew on them; where it has none, by one
    that is found if it is `wanted`, else None. Raises InputError where it makes no sense."""
    try:
        there = {entry["name"] for entry in record.get("objects", ()) if entry.get("fixed")}
        known = record.get("separable")
        loading = [] if known is None else known["loading"]
        pulls = [(str(one["name"]), [-float(x) for x in one["direction"]]) for one in reversed(loading)]
        if any(len(direction) != 3 or not direction[2] > 0 for _, direction in pulls):
            raise ValueError("a direction does not go down")
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(
            "the order in the run's result.json cannot be read; check the scene in a folder of its own"
        ) from error
    bodies = [replace(body, wishes=replace(body.wishes, fixed=body.name in there)) for body in bodies]
    if known is not None:
        return follow(bodies, matrices, container, pulls)
    return take_apart(Ways(bodies, matrices, container)) if wanted else None
