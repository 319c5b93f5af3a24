"""Eq. 5 and surface contact in compiled loops: surfaces that meet the container's wall and each other.

`losses.extrusion` and `contact` have the oracles in torch. Arrays only, no tensors; workers as in `overlap`, grids and
walls as in `grid`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..geometry.sdf import NEAR
from .frames import add_wrench, matrix, rotate, rotate_back
from .grid import nearest_along, sample_inline, wall_distance


@njit(cache=True, error_model="numpy", nogil=True)
def extrusion(worker, workers, wall, vertices, first, radius, rotation, translation, epsilon, sums):
    """Eq. 5: `sums` `(S, N, 13)`, each body's loss and wrench. Body i has the vertices `first[i]:first[i + 1]`."""
    bodies = len(radius)
    for job in range(worker, len(rotation) * bodies, workers):
        one, body = job // bodies, job % bodies
        r, t, total = matrix(rotation[one], body), translation[one, body], sums[one, body]
        if wall_distance(wall, t[0], t[1], t[2])[0] + radius[body] <= -epsilon:
            total[0] -= epsilon * (first[body + 1] - first[body])
            continue
        for v in range(first[body], first[body + 1]):
            x, y, z = vertices[v, 0], vertices[v, 1], vertices[v, 2]
            wx, wy, wz = rotate(r, x, y, z)
            value, nx, ny, nz = wall_distance(wall, wx + t[0], wy + t[1], wz + t[2])
            if value > -epsilon:
                add_wrench(total, value, x, y, z, nx, ny, nz)
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
        r, t, i = matrix(rotation, own), translation[own], own % bodies
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
            wx, wy, wz = rotate(r, points[sample, 0], points[sample, 1], points[sample, 2])
            wx, wy, wz = wx + t[0], wy + t[1], wz + t[2]
            for other in met[:meetings]:
                dx, dy, dz = wx - translation[other, 0], wy - translation[other, 1], wz - translation[other, 2]
                if abs(dx) >= boxes[other, 0] + reach or abs(dy) >= boxes[other, 1] + reach:
                    continue
                if abs(dz) >= boxes[other, 2] + reach:
                    continue
                j = other % bodies
                lx, ly, lz = rotate_back(matrix(rotation, other), dx, dy, dz)
                if abs(lx) >= half[j, 0] + reach or abs(ly) >= half[j, 1] + reach or abs(lz) >= half[j, 2] + reach:
                    continue
                cell = spacings[j]
                x = nearest_along((lx - origins[j, 0]) / cell, shapes[j, 0])
                y = nearest_along((ly - origins[j, 1]) / cell, shapes[j, 1])
                z = nearest_along((lz - origins[j, 2]) / cell, shapes[j, 2])
                if values[starts[j] + (x * shapes[j, 1] + y) * shapes[j, 2] + z] < reach + NEAR * cell:
                    touching = _append(touching, touching_count, sample, own, other)
                    touching_count += 1
        if i >= movers:
            continue
        size = math.sqrt(half[i, 0] ** 2 + half[i, 1] ** 2 + half[i, 2] ** 2)
        if wall_distance(wall, t[0], t[1], t[2])[0] + size <= -reach:
            continue
        for sample in range(first[i], first[i + 1]):
            wx, wy, wz = rotate(r, points[sample, 0], points[sample, 1], points[sample, 2])
            if wall_distance(wall, wx + t[0], wy + t[1], wz + t[2])[0] > -reach:
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
            wx, wy, wz = rotate(matrix(rotation, own), x, y, z)
            wx, wy, wz = wx + translation[own, 0], wy + translation[own, 1], wz + translation[own, 2]
            if other < 0:
                value, nx, ny, nz = wall_distance(wall, wx, wy, wz)
                depth = value + margin[own % bodies]
                if depth > 0:
                    push = area[sample] * depth
                    add_wrench(sums[chunk, own], push * depth, x, y, z, 2 * push * nx, 2 * push * ny, 2 * push * nz)
                continue
            r = matrix(rotation, other)
            wx, wy, wz = wx - translation[other, 0], wy - translation[other, 1], wz - translation[other, 2]
            lx, ly, lz = rotate_back(r, wx, wy, wz)
            value, sx, sy, sz = sample_inline(grids, other % bodies, lx, ly, lz)
            depth = margin[own % bodies] + margin[other % bodies] - value
            if depth > 0:
                push = area[sample] * depth
                fx, fy, fz = rotate(r, 2 * push * sx, 2 * push * sy, 2 * push * sz)
                add_wrench(sums[chunk, own], push * depth, x, y, z, -fx, -fy, -fz)
                add_wrench(sums[chunk, other], 0.0, lx, ly, lz, fx, fy, fz)
