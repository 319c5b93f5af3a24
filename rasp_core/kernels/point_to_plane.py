"""How a part's surface lies to a whole and to placed parts, under many poses: compiled by numba at first use.

Arrays only; `assembly.registration` says what is meant. A wall and grids are as in `grid`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from .grid import sample_inline, wall_distance


@njit(cache=True, error_model="numpy", nogil=True)
def look(points, normals, rotation, centre, wall, attracts, placed, skip, near, alike, draws, shares, square, slope):
    """Visit each of the part's points `(P, 3)` under each of B poses, and each boundary that it is near.

    placed : `(grids, half, radius, rotation, centre)` of the parts that have their places; the one numbered `skip` is
    not looked at. near : metres. alike : the least cosine between normals as they should lie. attracts : whether the
    wall counts as a boundary, or only as a bound.
    draws : to fill, for least squares point to plane, square `(B, 6, 6)`, slope `(B, 6)` (turn, shift), and the number
    of rows in shares `(B, 2)`; else shares : how much of the surface lies on boundaries, the more the nearer, and how
    much is beyond one by more than `near`.
    """
    grids, half, radius, turns, centres = placed
    own = 0.0
    for p in range(len(points)):
        own = max(own, points[p, 0] ** 2 + points[p, 1] ** 2 + points[p, 2] ** 2)
    own = math.sqrt(own)
    meets, row = np.empty(len(half), np.int64), np.empty(6)
    for b in range(len(rotation)):
        r, t = rotation[b], centre[b]
        count = 0
        for k in range(len(half)):
            away = (t[0] - centres[k, 0]) ** 2 + (t[1] - centres[k, 1]) ** 2 + (t[2] - centres[k, 2]) ** 2
            if k != skip and away < (own + radius[k] + near) ** 2:
                meets[count] = k
                count += 1
        for p in range(len(points)):
            px, py, pz = points[p, 0], points[p, 1], points[p, 2]
            ax = r[0, 0] * px + r[0, 1] * py + r[0, 2] * pz
            ay = r[1, 0] * px + r[1, 1] * py + r[1, 2] * pz
            az = r[2, 0] * px + r[2, 1] * py + r[2, 2] * pz
            nx = r[0, 0] * normals[p, 0] + r[0, 1] * normals[p, 1] + r[0, 2] * normals[p, 2]
            ny = r[1, 0] * normals[p, 0] + r[1, 1] * normals[p, 1] + r[1, 2] * normals[p, 2]
            nz = r[2, 0] * normals[p, 0] + r[2, 1] * normals[p, 1] + r[2, 2] * normals[p, 2]
            x, y, z = ax + t[0], ay + t[1], az + t[2]
            lies, leaves = 0.0, 0.0
            for m in range(-1, count):
                if m < 0:
                    distance, gx, gy, gz = wall_distance(wall, x, y, z)
                    along = nx * gx + ny * gy + nz * gz if attracts else -1.0
                    wrong = distance > 0
                else:
                    k = meets[m]
                    dx, dy, dz = x - centres[k, 0], y - centres[k, 1], z - centres[k, 2]
                    lx = turns[k, 0, 0] * dx + turns[k, 1, 0] * dy + turns[k, 2, 0] * dz
                    ly = turns[k, 0, 1] * dx + turns[k, 1, 1] * dy + turns[k, 2, 1] * dz
                    lz = turns[k, 0, 2] * dx + turns[k, 1, 2] * dy + turns[k, 2, 2] * dz
                    if abs(lx) >= half[k, 0] + near or abs(ly) >= half[k, 1] + near or abs(lz) >= half[k, 2] + near:
                        continue
                    distance, sx, sy, sz = sample_inline(grids, k, lx, ly, lz)
                    gx = turns[k, 0, 0] * sx + turns[k, 0, 1] * sy + turns[k, 0, 2] * sz
                    gy = turns[k, 1, 0] * sx + turns[k, 1, 1] * sy + turns[k, 1, 2] * sz
                    gz = turns[k, 2, 0] * sx + turns[k, 2, 1] * sy + turns[k, 2, 2] * sz
                    along = -(nx * gx + ny * gy + nz * gz)
                    wrong = distance < 0
                close = abs(distance) < near
                if not draws:
                    if close and along > alike:
                        lies = max(lies, 1 - abs(distance) / near)
                    if wrong and not close:
                        leaves = 1.0
                elif wrong or (close and along > alike):
                    row[0], row[1], row[2] = ay * gz - az * gy, az * gx - ax * gz, ax * gy - ay * gx
                    row[3], row[4], row[5] = gx, gy, gz
                    weight = 1 / (1 + (distance / near) ** 2)
                    lies += 1
                    for i in range(6):
                        slope[b, i] += weight * distance * row[i]
                        for j in range(6):
                            square[b, i, j] += weight * row[i] * row[j]
            shares[b, 0] += lies
            shares[b, 1] += leaves
        if not draws:
            shares[b, 0] /= len(points)
            shares[b, 1] /= len(points)
