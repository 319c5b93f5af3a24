"""Bodies as runs of voxels along z: what they share, and where one shares least, in compiled loops.

A turned body lies in `Voxels`; where it is placed, `shift` `(3,)` says of its first voxel. What two share counts by its
cube root, a length: a little of many others is worse than more of few, so that most pairs come to share nothing at all
(Gardeyn et al. 2025, sparrow, arXiv 2509.13329, have such a measure).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

POWER = np.float32(1 / 3)  # of the voxels that two share


class Voxels(NamedTuple):
    """T turned bodies, one after the other.

    sizes `(T, 3)` int64, in voxels. runs `(R, 4)` int32: x, y and the first voxel along z, and the one after the last,
    in rising order; of a body from begin `(T,)` to end `(T,)`. columns int64: for each x of a body, and the one after
    the last, its first run; of a body from columns_at `(T,)` on. below int16: `(X, Y, Z + 1)`, flat, of each body how
    many of its voxels lie below each; of a body from below_at `(T,)` on.
    """

    sizes: np.ndarray
    runs: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    columns: np.ndarray
    columns_at: np.ndarray
    below: np.ndarray
    below_at: np.ndarray


class Placed(NamedTuple):
    """N bodies, some of which may be alike: turn `(N,)`, which of the turned bodies each is, and shift `(N, 3)`."""

    turn: np.ndarray
    shift: np.ndarray


@njit(cache=True, nogil=True)
def add_up(blocks, voxels, placed, weights, size):
    """Set blocks to the sums of the bodies' voxels, times their weights `(N,)`, over cubes of `size` voxels."""
    blocks[:] = 0
    for body in range(len(weights)):
        if weights[body] == 0:
            continue
        turn, shift = placed.turn[body], placed.shift[body]
        for run in range(voxels.begin[turn], voxels.end[turn]):
            row = blocks[(voxels.runs[run, 0] + shift[0]) // size, (voxels.runs[run, 1] + shift[1]) // size]
            z, last = voxels.runs[run, 2] + shift[2], voxels.runs[run, 3] + shift[2]
            while z < last:
                cell = z // size
                stop = min((cell + 1) * size, last)
                row[cell] += weights[body] * np.float32(stop - z)
                z = stop


@njit(cache=True, nogil=True)
def shared_by_two(voxels, one, shift, other, there):
    """How many voxels two turned bodies share, one at `shift` and the other at `there`."""
    dx, dy, dz = shift[0] - there[0], shift[1] - there[1], shift[2] - there[2]
    wide, high = voxels.sizes[other, 1], voxels.sizes[other, 2]
    total = 0
    for x in range(max(0, -dx), min(voxels.sizes[one, 0], voxels.sizes[other, 0] - dx)):
        column = voxels.columns_at[one] + x
        row = voxels.below_at[other] + (x + dx) * wide * (high + 1)
        for run in range(voxels.columns[column], voxels.columns[column + 1]):
            y = voxels.runs[run, 1] + dy
            if y < 0:
                continue
            if y >= wide:
                break
            first, last = max(voxels.runs[run, 2] + dz, 0), min(voxels.runs[run, 3] + dz, high)
            if last > first:
                total += voxels.below[row + y * (high + 1) + last] - voxels.below[row + y * (high + 1) + first]
    return total


@njit(cache=True, nogil=True)
def shared_by_pairs(voxels, placed):
    """Voxels that two bodies share, `(N, N)` int64."""
    count = len(placed.turn)
    found = np.zeros((count, count), np.int64)
    for i in range(count):
        for j in range(i + 1, count):
            one, other = placed.turn[i], placed.turn[j]
            if _boxes_meet(voxels.sizes, one, placed.shift[i], other, placed.shift[j]):
                found[i, j] = shared_by_two(voxels, one, placed.shift[i], other, placed.shift[j])
                found[j, i] = found[i, j]
    return found


@njit(cache=True, nogil=True)
def overlap(voxels, placed, body, turn, shift, weights, most):
    """What a body would overlap as a turned body at a shift, or something above `most`: the sum over others of their
    weight `(N,)` times the cube root of the voxels shared."""
    total = np.float32(0)
    for other in range(len(placed.turn)):
        there = placed.turn[other]
        if other == body or not _boxes_meet(voxels.sizes, turn, shift, there, placed.shift[other]):
            continue
        count = shared_by_two(voxels, turn, shift, there, placed.shift[other])
        if count > 0:
            total += weights[other] * np.float32(count) ** POWER
            if total > most:
                break
    return total


@njit(cache=True, nogil=True)
def best_place(voxels, placed, body, weights, room, turns, shifts, refined, step, present):
    """Where a body overlaps least of some places, those that are best refined: turn, shift `(3,)` and `overlap`.

    turns `(K,)`, shifts `(K, 3)`: turned bodies and where they are tried; where it is now, with an overlap of
    `present`, is refined, too, and the answer if none is better. room `(3,)`: the box, in voxels. refined : how many.
    From each of these it goes downhill, a step of `step` voxels along an axis at a time, then of half of it, to one.
    """
    values = np.empty(len(turns), np.float32)
    least = np.full(refined, np.inf, np.float32)
    for k in range(len(turns)):
        values[k] = overlap(voxels, placed, body, turns[k], shifts[k], weights, least[-1])
        if values[k] < least[-1]:
            least[-1] = values[k]
            least.sort()
    best_turn, best_shift = placed.turn[body], placed.shift[body].copy()
    best = _downhill(voxels, placed, body, weights, room, best_turn, best_shift, present, step)
    for k in np.argsort(values)[:refined]:
        if best == 0:
            break
        shift = shifts[k].copy()
        value = _downhill(voxels, placed, body, weights, room, turns[k], shift, values[k], step)
        if value < best:
            best, best_turn, best_shift = value, turns[k], shift
    return best_turn, best_shift, best


@njit(cache=True, nogil=True)
def _downhill(voxels, placed, body, weights, room, turn, shift, value, step):
    """Move the shift `(3,)` to where no step overlaps less; what is overlapped there."""
    trial = np.empty(3, np.int64)
    while step >= 1 and value > 0:
        lower = False
        for move in range(6):
            axis = move // 2
            trial[:] = shift
            trial[axis] = min(
                max(shift[axis] + (step if move % 2 else -step), 0), room[axis] - voxels.sizes[turn, axis]
            )
            if trial[axis] == shift[axis]:
                continue
            there = overlap(voxels, placed, body, turn, trial, weights, value)
            if there < value:
                value, lower = there, True
                shift[:] = trial
                break
        if not lower:
            step //= 2
    return value


@njit(cache=True, nogil=True)
def _boxes_meet(sizes, one, shift, other, there):
    for axis in range(3):
        if shift[axis] >= there[axis] + sizes[other, axis] or there[axis] >= shift[axis] + sizes[one, axis]:
            return False
    return True
