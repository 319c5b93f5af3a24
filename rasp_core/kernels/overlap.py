"""Eq. 3 and 4 in compiled loops: which bodies the query points lie in, and how deep.

`query_points.occupancy` and `losses.overlap` have the oracles in torch. Arrays only, no tensors; results go into arrays
that the caller brings. A function that takes `worker` and `workers` does its part of the work, see
`dispatch.in_parallel`; each body is one worker's, so that results do not depend on how many there are. Poses are those
of S starts at once, `(S, N, 3, 3)` and `(S, N, 3)`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..geometry.sdf import NEAR
from .frames import add_wrench, matrix, rotate_back
from .grid import trilinear


@njit(cache=True, error_model="numpy", nogil=True)
def _visit(body, least, counts, grids, half, rotation, translation, lattice, shape, inside, sums):
    """Visit the lattice points in one body's box: count those inside, or add up depth, slopes and moments.

    least : 0 to count, else only points that lie in this many bodies matter. counts : flat, how many bodies a point
    lies in. grids : see `grid`. rotation `(N, 3, 3)`, translation `(N, 3)`. lattice : `(x, y, z, spacing)`.
    inside : flat bool or of length 0. sums `(13,)`: depth, slope, point (outer) slope.
    """
    values, starts, shapes, origins, spacings = grids
    counting = least == 0
    _, ny, nz = shape
    h = lattice[3]
    turn, r, t = rotation[body], matrix(rotation, body), translation[body]
    at, gy, gz = starts[body], shapes[body, 1], shapes[body, 2]
    cell = spacings[body]
    low, high = np.empty(2, np.int64), np.empty(2, np.int64)
    for a in range(2):
        reach = abs(turn[a, 0]) * half[body, 0] + abs(turn[a, 1]) * half[body, 1] + abs(turn[a, 2]) * half[body, 2]
        low[a] = max(0, math.ceil((t[a] - reach - lattice[a]) / h))
        high[a] = min(shape[a] - 1, math.floor((t[a] + reach - lattice[a]) / h))
    # along a column of points the place in the body's frame is base + iz * rise
    base, rise = np.empty(3), np.empty(3)
    for k in range(3):
        rise[k] = turn[2, k] * h
    for ix in range(low[0], high[0] + 1):
        for iy in range(low[1], high[1] + 1):
            dx, dy, dz = lattice[0] + ix * h - t[0], lattice[1] + iy * h - t[1], lattice[2] - t[2]
            base[0], base[1], base[2] = rotate_back(r, dx, dy, dz)
            enter, leave = 0.0, float(nz - 1)
            for k in range(3):
                step = rise[k] if abs(rise[k]) > 1e-12 else 1e-12
                first, last = (-half[body, k] - base[k]) / step, (half[body, k] - base[k]) / step
                enter, leave = max(enter, min(first, last)), min(leave, max(first, last))
            for iz in range(math.ceil(enter), math.floor(leave) + 1):
                point = (ix * ny + iy) * nz + iz
                if (not counting and counts[point] < least) or (len(inside) and not inside[point]):
                    continue
                qx, qy, qz = base[0] + iz * rise[0], base[1] + iz * rise[1], base[2] + iz * rise[2]
                x, y, z = (
                    (qx - origins[body, 0]) / cell,
                    (qy - origins[body, 1]) / cell,
                    (qz - origins[body, 2]) / cell,
                )
                if values[at + (int(x + 0.5) * gy + int(y + 0.5)) * gz + int(z + 0.5)] >= NEAR * cell:
                    continue
                i, j, k = int(x), int(y), int(z)
                corner = at + (i * gy + j) * gz + k
                value, sx, sy, sz = trilinear(values, corner, gy * gz, gz, x - i, y - j, z - k)
                if value >= 0:
                    continue
                if counting:
                    counts[point] += 1
                else:
                    add_wrench(sums, -value, qx, qy, qz, sx / cell, sy / cell, sz / cell)


@njit(cache=True, nogil=True)
def count(worker, workers, grids, half, rotation, translation, lattice, shape, inside, counts):
    """How many of this worker's bodies each lattice point lies in, added to its part of `counts` `(workers, S, P)`."""
    nothing = np.zeros(13)
    bodies = len(half)
    for job in range(worker, len(rotation) * bodies, workers):
        start, body = job // bodies, job % bodies
        _visit(
            body,
            0,
            counts[worker, start],
            grids,
            half,
            rotation[start],
            translation[start],
            lattice,
            shape,
            inside,
            nothing,
        )


@njit(cache=True, nogil=True)
def overlap(worker, workers, least, counts, grids, half, rotation, translation, lattice, shape, inside, sums):
    """Eq. 3-4 over points in at least `least` bodies: sums `(S, N, 13)`, depths and wrenches in the bodies' frames."""
    bodies = len(half)
    for job in range(worker, len(rotation) * bodies, workers):
        start, body = job // bodies, job % bodies
        _visit(
            body,
            least,
            counts[start],
            grids,
            half,
            rotation[start],
            translation[start],
            lattice,
            shape,
            inside,
            sums[start, body],
        )
