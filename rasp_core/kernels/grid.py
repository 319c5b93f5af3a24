"""The hot loops on the CPU, compiled by numba at first use; the plain torch versions are their oracles.

Arrays only, no tensors; results go into arrays that the caller brings. A function that takes `worker` and `workers`
does its share of the work, see `engine.share`; each body or row is one worker's, so that results do not depend on how
many there are. Poses are those of S starts at once, `(S, N, 3, 3)` and `(S, N, 3)`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..geometry.sdf import NEAR


@njit(cache=True, error_model="numpy", nogil=True)
def _scan(body, need, counts, grids, half, place, lattice, shape, inside, sums):
    """Visit the lattice points in one body's box: count those inside, or add up depth, slopes and moments.

    need : 0 to count, else only points that are in this many bodies. counts : flat, how many bodies a point is in.
    grids : `(values, start, shape, origin, spacing)`, see `sdf.GridStack`. lattice : `(x, y, z, spacing)`.
    inside : flat bool or of length 0. sums `(13,)`: depth, slope, point (outer) slope.
    """
    values, starts, shapes, origins, spacings = grids
    counting = need == 0
    _, ny, nz = shape
    h = lattice[3]
    r, t = place[0][body], place[1][body]
    at, gy, gz = starts[body], shapes[body, 1], shapes[body, 2]
    cell = spacings[body]
    low, high = np.empty(2, np.int64), np.empty(2, np.int64)
    for a in range(2):
        reach = abs(r[a, 0]) * half[body, 0] + abs(r[a, 1]) * half[body, 1] + abs(r[a, 2]) * half[body, 2]
        low[a] = max(0, math.ceil((t[a] - reach - lattice[a]) / h))
        high[a] = min(shape[a] - 1, math.floor((t[a] + reach - lattice[a]) / h))
    base, rise = np.empty(3), np.empty(3)
    for k in range(3):
        rise[k] = r[2, k] * h
    for ix in range(low[0], high[0] + 1):
        for iy in range(low[1], high[1] + 1):
            dx, dy, dz = lattice[0] + ix * h - t[0], lattice[1] + iy * h - t[1], lattice[2] - t[2]
            enter, leave = 0.0, float(nz - 1)
            for k in range(3):
                base[k] = r[0, k] * dx + r[1, k] * dy + r[2, k] * dz
                step = rise[k] if abs(rise[k]) > 1e-12 else 1e-12
                first, last = (-half[body, k] - base[k]) / step, (half[body, k] - base[k]) / step
                enter, leave = max(enter, min(first, last)), min(leave, max(first, last))
            for iz in range(math.ceil(enter), math.floor(leave) + 1):
                point = (ix * ny + iy) * nz + iz
                if (not counting and counts[point] < need) or (len(inside) and not inside[point]):
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
                fx, fy, fz = x - i, y - j, z - k
                o = at + (i * gy + j) * gz + k
                p = o + gy * gz
                c00 = values[o] + fx * (values[p] - values[o])
                c01 = values[o + 1] + fx * (values[p + 1] - values[o + 1])
                c10 = values[o + gz] + fx * (values[p + gz] - values[o + gz])
                c11 = values[o + gz + 1] + fx * (values[p + gz + 1] - values[o + gz + 1])
                c0, c1 = c00 + fy * (c10 - c00), c01 + fy * (c11 - c01)
                value = c0 + fz * (c1 - c0)
                if value >= 0:
                    continue
                if counting:
                    counts[point] += 1
                    continue
                d0 = (values[p] - values[o]) * (1 - fy) + (values[p + gz] - values[o + gz]) * fy
                d1 = (values[p + 1] - values[o + 1]) * (1 - fy) + (values[p + gz + 1] - values[o + gz + 1]) * fy
                sx = (d0 + fz * (d1 - d0)) / cell
                sy = ((c10 - c00) * (1 - fz) + (c11 - c01) * fz) / cell
                sz = (c1 - c0) / cell
                sums[0] -= value
                sums[1] += sx
                sums[2] += sy
                sums[3] += sz
                sums[4] += qx * sx
                sums[5] += qx * sy
                sums[6] += qx * sz
                sums[7] += qy * sx
                sums[8] += qy * sy
                sums[9] += qy * sz
                sums[10] += qz * sx
                sums[11] += qz * sy
                sums[12] += qz * sz


@njit(cache=True, nogil=True)
def count(worker, workers, grids, half, rotation, translation, lattice, shape, inside, counts):
    """How many of this worker's bodies each lattice point is in, added to its part of `counts` `(workers, S, P)`."""
    nothing = np.zeros(13)
    bodies = len(half)
    for job in range(worker, len(rotation) * bodies, workers):
        start, body = job // bodies, job % bodies
        place = rotation[start], translation[start]
        _scan(body, 0, counts[worker, start], grids, half, place, lattice, shape, inside, nothing)


@njit(cache=True, nogil=True)
def overlap(worker, workers, need, counts, grids, half, rotation, translation, lattice, shape, inside, sums):
    """Eq. 3-4 over points in at least `need` bodies: `sums` `(S, N, 13)`, depths and wrenches in the bodies' frames."""
    bodies = len(half)
    for job in range(worker, len(rotation) * bodies, workers):
        start, body = job // bodies, job % bodies
        place = rotation[start], translation[start]
        _scan(body, need, counts[start], grids, half, place, lattice, shape, inside, sums[start, body])


@njit(cache=True, nogil=True, fastmath=True)
def _add(target, source, weight):
    """`target += weight * source`, in a form that compiles to vector instructions."""
    for x in range(len(target)):
        target[x] += weight * source[x]


@njit(cache=True, nogil=True)
def blur_rows(worker, workers, images, kernel, out):
    """Images `(K, H, W)` blurred along their rows with an odd, symmetric kernel, 0 beyond the border; added to out."""
    views, height, width = images.shape
    reach = len(kernel) // 2
    for job in range(worker, views * height, workers):
        k, row = job // height, job % height
        for s in range(-reach, reach + 1):
            low, high = max(0, -s), min(width, width - s)
            _add(out[k, row, low:high], images[k, row, low + s : high + s], kernel[s + reach])


@njit(cache=True, nogil=True)
def blur_columns(worker, workers, images, kernel, out):
    """`blur_rows` along the columns."""
    views, height, _ = images.shape
    reach = len(kernel) // 2
    for job in range(worker, views * height, workers):
        k, row = job // height, job % height
        for s in range(max(-reach, -row), min(reach + 1, height - row)):
            _add(out[k, row], images[k, row + s], kernel[s + reach])
