"""Creases of one surface against those of another, under many poses: compiled at first use.

A crease point has a place and the two normals beside it. Where a surface was broken, the creases of both sides lie on
each other: the broken faces against each other, the unbroken ones in one sheet. Nearest points are looked up in a grid.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from .frames import matrix, rotate
from .grid import sample_inline


class Creases(NamedTuple):
    """points, first, second `(E, 3)`: places in metres, and the unit normals on both sides of each."""

    points: np.ndarray
    first: np.ndarray
    second: np.ndarray


class Lookup(NamedTuple):
    """Which crease point is nearest to the middle of each cell of a grid, -1 where none is near.

    nearest `(X, Y, Z)` int32; origin `(3,)`: the lowest corner; cell : edge of a cell, metres.
    """

    nearest: np.ndarray
    origin: np.ndarray
    cell: float


@njit(cache=True, error_model="numpy", nogil=True)
def matches(creases, lookup, moving, rotation, translation, reach, cosine):
    """`(B, E)`: which of the crease points `moving` lie on `creases` under each of B poses: 1 there, the less the
    farther away, 0 from `reach`.

    rotation `(B, 3, 3)`, translation `(B, 3)` metres: of what moves. reach : how near is near, metres. cosine : the
    least between the unbroken normals, and between one broken normal and the other's opposite.
    """
    found = np.zeros((len(rotation), len(moving.points)))
    for b in range(len(rotation)):
        r = matrix(rotation, b)
        tx, ty, tz = translation[b, 0], translation[b, 1], translation[b, 2]
        for k in range(len(moving.points)):
            near, _, square = _partner(creases, lookup, moving, r, tx, ty, tz, k, reach, cosine)
            if near >= 0:
                found[b, k] = 1 - square / reach**2
    return found


@njit(cache=True, error_model="numpy", nogil=True)
def moments(creases, lookup, moving, rotation, translation, reach, cosine):
    """What the rigid motion is computed of that brings matched crease points together; arguments as of `matches`.

    Returns weight `(B,)`; sums of the weighted places, at rest and of what moves in its own frame, `(B, 3)` each; and
    the sums of outer products, rest by moving, of places and of normals, `(B, 3, 3)` each.
    """
    count = len(rotation)
    weight, rest, own = np.zeros(count), np.zeros((count, 3)), np.zeros((count, 3))
    places, normals = np.zeros((count, 3, 3)), np.zeros((count, 3, 3))
    for b in range(count):
        r = matrix(rotation, b)
        tx, ty, tz = translation[b, 0], translation[b, 1], translation[b, 2]
        for k in range(len(moving.points)):
            j, kind, square = _partner(creases, lookup, moving, r, tx, ty, tz, k, reach, cosine)
            if j < 0:
                continue
            w = 1 / (1 + 4 * square / reach**2)
            broken, whole = creases.first[j], creases.second[j]
            if kind & 1:
                broken, whole = whole, broken
            own_broken, own_whole = moving.first[k], moving.second[k]
            if kind & 2:
                own_broken, own_whole = own_whole, own_broken
            weight[b] += w
            for x in range(3):
                rest[b, x] += w * creases.points[j, x]
                own[b, x] += w * moving.points[k, x]
                for y in range(3):
                    places[b, x, y] += w * creases.points[j, x] * moving.points[k, y]
                    normals[b, x, y] += w * (whole[x] * own_whole[y] - broken[x] * own_broken[y])
    return weight, rest, own, places, normals


@njit(inline="always", error_model="numpy")
def _partner(creases, lookup, moving, r, tx, ty, tz, k, reach, cosine):
    """The crease point on which point k lies, -1 if none; which normal is the broken one (bit 0 of the resting point's
    set: the second, bit 1 of the moving one's); and the square of their distance."""
    nearest, origin, cell = lookup
    points, first, second = creases
    own, own_first, own_second = moving
    near, kind, square = -1, 0, math.inf
    x, y, z = rotate(r, own[k, 0], own[k, 1], own[k, 2])
    x, y, z = x + tx, y + ty, z + tz
    cx, cy, cz = (x - origin[0]) / cell, (y - origin[1]) / cell, (z - origin[2]) / cell
    if 0 <= cx < nearest.shape[0] and 0 <= cy < nearest.shape[1] and 0 <= cz < nearest.shape[2]:
        near = nearest[int(cx), int(cy), int(cz)]
    if near >= 0:
        square = (points[near, 0] - x) ** 2 + (points[near, 1] - y) ** 2 + (points[near, 2] - z) ** 2
        if square >= reach**2:
            near = -1
    if near >= 0:
        ax, ay, az = rotate(r, own_first[k, 0], own_first[k, 1], own_first[k, 2])
        bx, by, bz = rotate(r, own_second[k, 0], own_second[k, 1], own_second[k, 2])
        fx, fy, fz = first[near, 0], first[near, 1], first[near, 2]
        sx, sy, sz = second[near, 0], second[near, 1], second[near, 2]
        fa, fb = fx * ax + fy * ay + fz * az, fx * bx + fy * by + fz * bz
        sa, sb = sx * ax + sy * ay + sz * az, sx * bx + sy * by + sz * bz
        # the worse of both conditions, for each way to say which side is the broken one
        best = min(-fa, sb)
        if min(-sa, fb) > best:
            kind, best = 1, min(-sa, fb)
        if min(-fb, sa) > best:
            kind, best = 2, min(-fb, sa)
        if min(-sb, fa) > best:
            kind, best = 3, min(-sb, fa)
        if best <= cosine:
            near = -1
    return near, kind, square


@njit(cache=True, error_model="numpy", nogil=True)
def marks(creases, lookup, grids, half_extents, moving, strips, rotation, translation, reach, near, cosine):
    """`(B, E)` uint8: of each crease point of what moves, 1 if a crease point of the resting piece is within `reach`,
    2 and 4 if the first and the second face beside it lie on the resting piece.

    grids, half_extents `(3,)`: the resting piece's. strips `(2, E, 3)`: a place on each face, near the crease. A face
    lies on the piece where its place is nearer than `near` and the normals are opposite, by `cosine`.
    """
    found = np.zeros((len(rotation), len(moving.points)), np.uint8)
    nearest, origin, cell = lookup
    hx, hy, hz = half_extents[0] + near, half_extents[1] + near, half_extents[2] + near
    for b in range(len(rotation)):
        r = matrix(rotation, b)
        tx, ty, tz = translation[b, 0], translation[b, 1], translation[b, 2]
        for k in range(len(moving.points)):
            x, y, z = rotate(r, moving.points[k, 0], moving.points[k, 1], moving.points[k, 2])
            x, y, z = x + tx, y + ty, z + tz
            cx, cy, cz = (x - origin[0]) / cell, (y - origin[1]) / cell, (z - origin[2]) / cell
            mark = 0
            if 0 <= cx < nearest.shape[0] and 0 <= cy < nearest.shape[1] and 0 <= cz < nearest.shape[2]:
                n = nearest[int(cx), int(cy), int(cz)]
                if n >= 0:
                    p = creases.points
                    if (p[n, 0] - x) ** 2 + (p[n, 1] - y) ** 2 + (p[n, 2] - z) ** 2 < reach**2:
                        mark = 1
            for side in range(2):
                x, y, z = rotate(r, strips[side, k, 0], strips[side, k, 1], strips[side, k, 2])
                x, y, z = x + tx, y + ty, z + tz
                if abs(x) >= hx or abs(y) >= hy or abs(z) >= hz:
                    continue
                distance, gx, gy, gz = sample_inline(grids, 0, x, y, z)
                if abs(distance) >= near:
                    continue
                normal = moving.first if side == 0 else moving.second
                nx, ny, nz = rotate(r, normal[k, 0], normal[k, 1], normal[k, 2])
                if -(nx * gx + ny * gy + nz * gz) > cosine:
                    mark |= 2 << side
            found[b, k] = mark
    return found
