"""Surfaces that meet others and walls, on the CPU: extrusion and contact, compiled by numba at first use.

The plain torch versions in `losses` and `contact` are the oracles. Arrays only, no tensors; see `kernels`.
A wall is `(half, centre, grid)`: half `(3,)` of a box about the origin, else of length 0; the grid of a mesh as
`sdf.GridStack.arrays` has it, in a frame about centre.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..geometry.sdf import NEAR


@njit(cache=True, error_model="numpy", nogil=True)
def _sample(grids, body, x, y, z):
    """Signed distance at a place in a body's frame and its gradient, as `sdf.GridStack.sample` has them."""
    values, starts, shapes, origins, spacings = grids
    cell, at = spacings[body], starts[body]
    ny, nz = shapes[body, 1], shapes[body, 2]
    px, py, pz = (x - origins[body, 0]) / cell, (y - origins[body, 1]) / cell, (z - origins[body, 2]) / cell
    ix = min(max(px, 0.0), float(shapes[body, 0] - 1))
    iy = min(max(py, 0.0), float(ny - 1))
    iz = min(max(pz, 0.0), float(nz - 1))
    i, j, k = min(int(ix), shapes[body, 0] - 2), min(int(iy), ny - 2), min(int(iz), nz - 2)
    fx, fy, fz = ix - i, iy - j, iz - k
    o = at + (i * ny + j) * nz + k
    p = o + ny * nz
    c00 = values[o] + fx * (values[p] - values[o])
    c01 = values[o + 1] + fx * (values[p + 1] - values[o + 1])
    c10 = values[o + nz] + fx * (values[p + nz] - values[o + nz])
    c11 = values[o + nz + 1] + fx * (values[p + nz + 1] - values[o + nz + 1])
    c0, c1 = c00 + fy * (c10 - c00), c01 + fy * (c11 - c01)
    value = c0 + fz * (c1 - c0)
    bx, by, bz = (px - ix) * cell, (py - iy) * cell, (pz - iz) * cell
    d0 = (values[p] - values[o]) * (1 - fy) + (values[p + nz] - values[o + nz]) * fy
    d1 = (values[p + 1] - values[o + 1]) * (1 - fy) + (values[p + nz + 1] - values[o + nz + 1]) * fy
    sx, sy, sz = (d0 + fz * (d1 - d0)) / cell, ((c10 - c00) * (1 - fz) + (c11 - c01) * fz) / cell, (c1 - c0) / cell
    beyond = math.sqrt(bx * bx + by * by + bz * bz)
    if beyond > 0:  # along the axes that were clamped, the distance to the grid grows and the value stays
        sx, sy, sz = bx / beyond if bx else sx, by / beyond if by else sy, bz / beyond if bz else sz
    return value + beyond, sx, sy, sz


@njit(cache=True, error_model="numpy", nogil=True)
def _to_wall(wall, x, y, z):
    """Distance to a container's wall, negative inside, and its gradient, as `Container.signed_distance` has them."""
    half, centre, grid = wall
    if len(half) == 0:
        return _sample(grid, 0, x - centre[0], y - centre[1], z - centre[2])
    bx, by, bz = abs(x) - half[0], abs(y) - half[1], abs(z) - half[2]
    sx, sy, sz = math.copysign(1.0, x), math.copysign(1.0, y), math.copysign(1.0, z)
    deepest = max(bx, by, bz)
    if deepest > 0:
        bx, by, bz = max(bx, 0.0), max(by, 0.0), max(bz, 0.0)
        distance = math.sqrt(bx * bx + by * by + bz * bz)
        return distance, sx * bx / distance, sy * by / distance, sz * bz / distance
    if bx == deepest:
        return deepest, sx, 0.0, 0.0
    if by == deepest:
        return deepest, 0.0, sy, 0.0
    return deepest, 0.0, 0.0, sz


@njit(cache=True, error_model="numpy", nogil=True)
def _place(r, t, x, y, z):
    """A point in a body's frame -> world."""
    return (
        r[0, 0] * x + r[0, 1] * y + r[0, 2] * z + t[0],
        r[1, 0] * x + r[1, 1] * y + r[1, 2] * z + t[1],
        r[2, 0] * x + r[2, 1] * y + r[2, 2] * z + t[2],
    )


@njit(cache=True, error_model="numpy", nogil=True)
def _add(sums, value, x, y, z, fx, fy, fz):
    """Add a value, and a world force at a point in the body's frame, to `sums` `(13,)`."""
    sums[0] += value
    sums[1] += fx
    sums[2] += fy
    sums[3] += fz
    sums[4] += x * fx
    sums[5] += x * fy
    sums[6] += x * fz
    sums[7] += y * fx
    sums[8] += y * fy
    sums[9] += y * fz
    sums[10] += z * fx
    sums[11] += z * fy
    sums[12] += z * fz


@njit(cache=True, error_model="numpy", nogil=True)
def extrusion(worker, workers, wall, vertices, first, radius, rotation, translation, epsilon, sums):
    """Eq. 5: `sums` `(S, N, 13)`, each body's loss and wrench. Body i has the vertices `first[i]:first[i + 1]`."""
    bodies = len(radius)
    for job in range(worker, len(rotation) * bodies, workers):
        one, body = job // bodies, job % bodies
        r, t, total = rotation[one, body], translation[one, body], sums[one, body]
        centre = _to_wall(wall, t[0], t[1], t[2])[0]
        if centre + radius[body] <= -epsilon:
            total[0] -= epsilon * (first[body + 1] - first[body])
            continue
        for v in range(first[body], first[body + 1]):
            x, y, z = vertices[v, 0], vertices[v, 1], vertices[v, 2]
            wx, wy, wz = _place(r, t, x, y, z)
            value, nx, ny, nz = _to_wall(wall, wx, wy, wz)
            if value > -epsilon:
                _add(total, value, x, y, z, nx, ny, nz)
            else:
                total[0] -= epsilon


@njit(cache=True, error_model="numpy", nogil=True)
def _append(found, count, sample, own, other):
    """Write a row at `count`, into a copy of twice the size where there is no room; returns the array."""
    if count == len(found):
        larger = np.empty((2 * count, 3), np.int32)
        for row in range(count):
            for column in range(3):
                larger[row, column] = found[row, column]
        found = larger
    found[count, 0], found[count, 1], found[count, 2] = sample, own, other
    return found


@njit(cache=True, error_model="numpy", nogil=True)
def neighbours(chunk, chunks, wall, grids, half, rotation, translation, points, first, reach, movers):
    """Rows (sample, own, other) of the samples of every `chunks`-th body near another body, and (sample, own, -1) of
    those near the wall; see `contact.neighbours`. Body i has the samples `first[i]:first[i + 1]`; body i of start s
    is called `s * N + i`. Bodies from `movers` on do not move."""
    bodies, placed = len(half), rotation.shape[0] * len(half)
    rotation, translation = rotation.reshape(placed, 3, 3), translation.reshape(placed, 3)
    boxes = np.zeros((placed, 3))
    for body in range(placed):
        for a in range(3):
            for c in range(3):
                boxes[body, a] += abs(rotation[body, a, c]) * half[body % bodies, c]
    touching, by_wall = np.empty((1024, 3), np.int32), np.empty((1024, 3), np.int32)
    touching_count, wall_count = 0, 0
    met = np.empty(bodies, np.int64)
    values, starts, shapes, origins, spacings = grids
    for own in range(chunk, placed, chunks):
        r, t, i = rotation[own], translation[own], own % bodies
        meetings = 0
        for other in range(own - i, own - i + bodies):
            apart = own == other or (i >= movers and other - own + i >= movers)
            for a in range(3):
                if abs(t[a] - translation[other, a]) > boxes[own, a] + boxes[other, a] + reach:
                    apart = True
            if not apart:
                met[meetings] = other
                meetings += 1
        for sample in range(first[i], first[i + 1] if meetings else first[i]):
            wx, wy, wz = _place(r, t, points[sample, 0], points[sample, 1], points[sample, 2])
            for other in met[:meetings]:
                # written out here: a function that is given arrays for each sample costs ten times as much
                dx, dy, dz = wx - translation[other, 0], wy - translation[other, 1], wz - translation[other, 2]
                if abs(dx) >= boxes[other, 0] + reach or abs(dy) >= boxes[other, 1] + reach:
                    continue
                if abs(dz) >= boxes[other, 2] + reach:
                    continue
                j, m = other % bodies, other
                lx = rotation[m, 0, 0] * dx + rotation[m, 1, 0] * dy + rotation[m, 2, 0] * dz
                ly = rotation[m, 0, 1] * dx + rotation[m, 1, 1] * dy + rotation[m, 2, 1] * dz
                lz = rotation[m, 0, 2] * dx + rotation[m, 1, 2] * dy + rotation[m, 2, 2] * dz
                if abs(lx) >= half[j, 0] + reach or abs(ly) >= half[j, 1] + reach or abs(lz) >= half[j, 2] + reach:
                    continue
                cell = spacings[j]
                x = min(max(int((lx - origins[j, 0]) / cell + 0.5), 0), shapes[j, 0] - 1)
                y = min(max(int((ly - origins[j, 1]) / cell + 0.5), 0), shapes[j, 1] - 1)
                z = min(max(int((lz - origins[j, 2]) / cell + 0.5), 0), shapes[j, 2] - 1)
                if values[starts[j] + (x * shapes[j, 1] + y) * shapes[j, 2] + z] < reach + NEAR * cell:
                    touching = _append(touching, touching_count, sample, own, other)
                    touching_count += 1
        if i >= movers:
            continue
        size = math.sqrt(half[i, 0] ** 2 + half[i, 1] ** 2 + half[i, 2] ** 2)
        if _to_wall(wall, t[0], t[1], t[2])[0] + size <= -reach:
            continue
        for sample in range(first[i], first[i + 1]):
            wx, wy, wz = _place(r, t, points[sample, 0], points[sample, 1], points[sample, 2])
            if _to_wall(wall, wx, wy, wz)[0] > -reach:
                by_wall = _append(by_wall, wall_count, sample, own, -1)
                wall_count += 1
    return touching[:touching_count], by_wall[:wall_count]


@njit(cache=True, error_model="numpy", nogil=True)
def contact(worker, workers, wall, grids, points, area, rotation, translation, margin, near, sums):
    """Contact of the rows that `neighbours` found: `sums` `(chunks, S * N, 13)`, each body's loss and wrench.

    The rows are cut into as many chunks as `sums` has, whoever does them.
    """
    chunks, bodies, placed = len(sums), len(margin), sums.shape[1]
    rotation, translation = rotation.reshape(placed, 3, 3), translation.reshape(placed, 3)
    for chunk in range(worker, chunks, workers):
        for row in range(chunk * len(near) // chunks, (chunk + 1) * len(near) // chunks):
            sample, own, other = near[row]
            x, y, z = points[sample, 0], points[sample, 1], points[sample, 2]
            wx, wy, wz = _place(rotation[own], translation[own], x, y, z)
            if other < 0:
                value, nx, ny, nz = _to_wall(wall, wx, wy, wz)
                depth = value + margin[own % bodies]
                if depth > 0:
                    push = area[sample] * depth
                    _add(sums[chunk, own], push * depth, x, y, z, 2 * push * nx, 2 * push * ny, 2 * push * nz)
                continue
            turn, shift = rotation[other], translation[other]
            wx, wy, wz = wx - shift[0], wy - shift[1], wz - shift[2]
            lx = turn[0, 0] * wx + turn[1, 0] * wy + turn[2, 0] * wz
            ly = turn[0, 1] * wx + turn[1, 1] * wy + turn[2, 1] * wz
            lz = turn[0, 2] * wx + turn[1, 2] * wy + turn[2, 2] * wz
            value, sx, sy, sz = _sample(grids, other % bodies, lx, ly, lz)
            depth = margin[own % bodies] + margin[other % bodies] - value
            if depth > 0:
                push = area[sample] * depth
                sx, sy, sz = 2 * push * sx, 2 * push * sy, 2 * push * sz
                fx = turn[0, 0] * sx + turn[0, 1] * sy + turn[0, 2] * sz
                fy = turn[1, 0] * sx + turn[1, 1] * sy + turn[1, 2] * sz
                fz = turn[2, 0] * sx + turn[2, 1] * sy + turn[2, 2] * sz
                _add(sums[chunk, own], push * depth, x, y, z, -fx, -fy, -fz)
                _add(sums[chunk, other], 0.0, lx, ly, lz, fx, fy, fz)
