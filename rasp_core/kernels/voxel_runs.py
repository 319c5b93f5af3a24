"""Bodies as runs of voxels along z, weighed, moved and counted in compiled loops.

runs `(R, 4)` int32: x, y and the first voxel along z, and the one after the last, from the body's first voxel. A turned
body is the runs from `begin` to `end`; shift `(3,)`: where its first voxel lies.
"""

from __future__ import annotations

import numpy as np
from numba import njit

AT_ONCE = 64  # runs between two looks at whether it is too much already


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
    last = field.shape[2]
    for x in range(field.shape[0]):
        for y in range(field.shape[1]):
            column, added = field[x, y], sums[x, y]
            total = np.float32(0)
            added[0] = 0
            for z in range(last):
                total += column[z]
                added[z + 1] = total
            row = blocks[x // size, y // size]
            for k in range(len(row)):
                row[k] += added[min((k + 1) * size, last)] - added[k * size]


def ends(runs: np.ndarray, shape: tuple[int, int, int]) -> np.ndarray:
    """Where in the flat sums of a field of this shape `(X, Y, Z)` what lies below each run's first voxel stands, and
    below the one after its last, `(2, R)` int32, as long as the body's first voxel is the field's."""
    x, y, first, last = runs.T.astype(np.int32)
    column = (x * shape[1] + y) * (shape[2] + 1)
    return np.ascontiguousarray(np.stack([column + first, column + last]), np.int32)


@njit(cache=True, nogil=True)
def shared(sums, ends, begin, end, at, most):
    """What a turned body shares with the field, or something above `most`.

    sums : flat. ends `(2, R)` : see above. at : where in the sums the body's first voxel stands.
    """
    first, last = ends[0], ends[1]
    total = np.float32(0)
    run = begin
    while run < end and total <= most:
        stop = min(run + AT_ONCE, end)
        for k in range(run, stop):
            total += sums[np.uint32(last[k] + at)] - sums[np.uint32(first[k] + at)]
        run = stop
    return total


@njit(cache=True, nogil=True)
def descend(sums, ends, begins, ends_of, sizes, shifts, step):
    """From each of K places downhill, a step of `step` voxels along an axis at a time, then of half of it, to one.

    begins, ends_of `(K,)`, sizes `(K, 3)`: of the turned body at each place; shifts `(K, 3)` are moved. Returns what is
    shared at each in the end, `(K,)`.
    """
    room = np.array([sums.shape[0], sums.shape[1], sums.shape[2] - 1])
    stride = np.array([sums.shape[1] * sums.shape[2], sums.shape[2], 1])
    flat = sums.ravel()
    found = np.empty(len(begins), np.float32)
    for k in range(len(begins)):
        at = (shifts[k] * stride).sum()
        best = shared(flat, ends, begins[k], ends_of[k], at, np.float32(np.inf))
        length = step
        while length >= 1 and best > 0:
            least = -1
            for move in range(6):
                axis, way = move // 2, length if move % 2 else -length
                if shifts[k, axis] + way < 0 or shifts[k, axis] + way + sizes[k, axis] > room[axis]:
                    continue
                value = shared(flat, ends, begins[k], ends_of[k], at + way * stride[axis], best)
                if value < best:
                    best, least = value, move
            if least < 0:
                length //= 2
            else:
                axis, way = least // 2, length if least % 2 else -length
                shifts[k, axis] += way
                at += way * stride[axis]
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
        piece = field[x, y, runs[run, 2] + shift[2] : runs[run, 3] + shift[2]]
        for z in range(len(piece)):
            piece[z] += value
