"""Bodies as runs of voxels along z, weighed, moved and counted in compiled loops.

runs `(R, 4)` int32: x, y and the first voxel along z, and the one after the last, from the body's first voxel. A turned
body is the runs from `begin` to `end`; shift `(3,)`: where its first voxel lies.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def weigh(field, runs, begin, end, shifts, weights):
    """Set the field `(X, Y, Z)` to the sum of the weights `(N,)` of the bodies that take each voxel."""
    field[:] = 0
    for body in range(len(begin)):
        if weights[body] != 0:
            _add(field, runs, begin[body], end[body], shifts[body], weights[body])


@njit(cache=True, nogil=True)
def add_up(field, sums, blocks, size):
    """Sums `(X, Y, Z + 1)` of the field below each voxel, and blocks: its sums over cubes of `size` voxels."""
    blocks[:] = 0
    for x in range(field.shape[0]):
        for y in range(field.shape[1]):
            total = np.float32(0)
            sums[x, y, 0] = 0
            for z in range(field.shape[2]):
                total += field[x, y, z]
                sums[x, y, z + 1] = total
                blocks[x // size, y // size, z // size] += field[x, y, z]


@njit(cache=True, nogil=True)
def shared(sums, runs, begin, end, x, y, z, most):
    """What a turned body at a shift shares with the field, or something above `most`."""
    total = np.float32(0)
    for run in range(begin, end):
        column = sums[runs[run, 0] + x, runs[run, 1] + y]
        total += column[runs[run, 3] + z] - column[runs[run, 2] + z]
        if total > most:
            break
    return total


@njit(cache=True, nogil=True)
def descend(sums, runs, begins, ends, sizes, shifts, step):
    """From each of K places downhill, a step of `step` voxels along an axis at a time, then of half of it, to one.

    begins, ends `(K,)`, sizes `(K, 3)`: of the turned body at each place; shifts `(K, 3)` are moved. Returns what is
    shared at each in the end, `(K,)`.
    """
    room = np.array([sums.shape[0], sums.shape[1], sums.shape[2] - 1])
    found = np.empty(len(begins), np.float32)
    trial, least = np.empty(3, np.int64), np.empty(3, np.int64)
    for k in range(len(begins)):
        best = shared(sums, runs, begins[k], ends[k], shifts[k, 0], shifts[k, 1], shifts[k, 2], np.float32(np.inf))
        length = step
        while length >= 1 and best > 0:
            least[:] = shifts[k]
            for move in range(6):
                trial[:] = shifts[k]
                trial[move // 2] += length if move % 2 else -length
                if trial.min() < 0 or (trial + sizes[k] > room).any():
                    continue
                value = shared(sums, runs, begins[k], ends[k], trial[0], trial[1], trial[2], best)
                if value < best:
                    best, least[:] = value, trial
            if (least == shifts[k]).all():
                length //= 2
            else:
                shifts[k] = least
        found[k] = best
    return found


@njit(cache=True, nogil=True)
def shared_by_pairs(mark, runs, begin, end, shifts, sizes):
    """Voxels that two bodies share, `(N, N)`; mark `(X, Y, Z)` int8: zeros, and zeros again afterwards."""
    count = len(begin)
    found = np.zeros((count, count), np.int64)
    for i in range(count):
        marked = False
        for j in range(i + 1, count):
            if (shifts[i] >= shifts[j] + sizes[j]).any() or (shifts[j] >= shifts[i] + sizes[i]).any():
                continue
            if not marked:
                _add(mark, runs, begin[i], end[i], shifts[i], 1)
                marked = True
            total = 0
            for run in range(begin[j], end[j]):
                x, y = runs[run, 0] + shifts[j, 0], runs[run, 1] + shifts[j, 1]
                for z in range(runs[run, 2] + shifts[j, 2], runs[run, 3] + shifts[j, 2]):
                    total += mark[x, y, z]
            found[i, j] = found[j, i] = total
        if marked:
            _add(mark, runs, begin[i], end[i], shifts[i], -1)
    return found


@njit(cache=True, nogil=True)
def _add(field, runs, begin, end, shift, value):
    for run in range(begin, end):
        x, y = runs[run, 0] + shift[0], runs[run, 1] + shift[1]
        for z in range(runs[run, 2] + shift[2], runs[run, 3] + shift[2]):
            field[x, y, z] += value
