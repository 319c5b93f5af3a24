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


class Creases(NamedTuple):
    """points, first, second `(E, 3)`: places in metres, and the unit normals on both sides of each. weights `(E, 2)`:
    what a match counts whose broken face is the one with the first normal, and the second."""

    points: np.ndarray
    first: np.ndarray
    second: np.ndarray
    weights: np.ndarray


class Lookup(NamedTuple):
    """Which crease point is nearest to the middle of each cell of a grid, -1 where none is near.

    nearest `(X, Y, Z)` int32; origin `(3,)`: the lowest corner; cell : edge of a cell, metres.
    """

    nearest: np.ndarray
    origin: np.ndarray
    cell: float


@njit(cache=True, error_model="numpy", nogil=True)
def matched(creases, lookup, moving, rotation, translation, reach, cosine):
    """`(B,)`: how many of the crease points `moving` lie on `creases` under each of B poses, the nearer the more.

    rotation `(B, 3, 3)`, translation `(B, 3)` metres: of what moves. reach : how near is near, metres. cosine : the
    least between the unbroken normals, and between one broken normal and the other's opposite.
    """
    found = np.zeros(len(rotation))
    for b in range(len(rotation)):
        r = matrix(rotation, b)
        for k in range(len(moving.points)):
            near, kind, square = _partner(creases, lookup, moving, r, translation[b], k, reach, cosine)
            if near >= 0:
                counts = min(creases.weights[near, kind & 1], moving.weights[k, kind >> 1])
                found[b] += counts * (1 - square / reach**2)
    return found


@njit(cache=True, error_model="numpy", nogil=True)
def moments(creases, lookup, moving, rotation, translation, reach, cosine):
    """What the rigid motion is computed of that brings matched crease points together; arguments as of `matched`.

    Returns weight `(B,)`; sums of the weighted places, at rest and of what moves in its own frame, `(B, 3)` each; and
    the sums of outer products, rest by moving, of places and of normals, `(B, 3, 3)` each.
    """
    count = len(rotation)
    weight, rest, own = np.zeros(count), np.zeros((count, 3)), np.zeros((count, 3))
    places, normals = np.zeros((count, 3, 3)), np.zeros((count, 3, 3))
    for b in range(count):
        r = matrix(rotation, b)
        for k in range(len(moving.points)):
            j, kind, square = _partner(creases, lookup, moving, r, translation[b], k, reach, cosine)
            if j < 0:
                continue
            counts = min(creases.weights[j, kind & 1], moving.weights[k, kind >> 1])
            w = counts / (1 + 4 * square / reach**2)
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


@njit(cache=True, error_model="numpy", nogil=True)
def _partner(creases, lookup, moving, r, shift, k, reach, cosine):
    """The crease point on which point k lies, -1 if none; which normal is the broken one (bit 0 of the resting point's
    set: the second, bit 1 of the moving one's); and the square of their distance."""
    nearest, origin, cell = lookup
    x, y, z = rotate(r, moving.points[k, 0], moving.points[k, 1], moving.points[k, 2])
    x, y, z = x + shift[0], y + shift[1], z + shift[2]
    i = math.floor((x - origin[0]) / cell)
    j = math.floor((y - origin[1]) / cell)
    m = math.floor((z - origin[2]) / cell)
    if not (0 <= i < nearest.shape[0] and 0 <= j < nearest.shape[1] and 0 <= m < nearest.shape[2]):
        return -1, 0, math.inf
    near = nearest[i, j, m]
    if near < 0:
        return -1, 0, math.inf
    px, py, pz = creases.points[near, 0] - x, creases.points[near, 1] - y, creases.points[near, 2] - z
    square = px**2 + py**2 + pz**2
    if square >= reach**2:
        return -1, 0, math.inf
    ax, ay, az = rotate(r, moving.first[k, 0], moving.first[k, 1], moving.first[k, 2])
    bx, by, bz = rotate(r, moving.second[k, 0], moving.second[k, 1], moving.second[k, 2])
    f, s = creases.first[near], creases.second[near]
    fa, fb = f[0] * ax + f[1] * ay + f[2] * az, f[0] * bx + f[1] * by + f[2] * bz
    sa, sb = s[0] * ax + s[1] * ay + s[2] * az, s[0] * bx + s[1] * by + s[2] * bz
    # the worse of both conditions, for each way to say which side is the broken one
    ways = (min(-fa, sb), min(-sa, fb), min(-fb, sa), min(-sb, fa))
    kind, best = 0, ways[0]
    for way in range(1, 4):
        if ways[way] > best:
            kind, best = way, ways[way]
    if best <= cosine:
        return -1, 0, math.inf
    return near, kind, square
