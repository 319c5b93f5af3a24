"""A part's surface against the surface of a whole and of placed parts, under many poses: compiled at first use.

`coverage` says how much of it lies there, `normal_equations` how to move it there (point to plane, Chen & Medioni).
The surfaces are signed distances: no pairs of points have to be found. A wall and grids are as in `grid`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from .frames import matrix, rotate, rotate_back
from .grid import sample_inline, wall_distance


class Surface(NamedTuple):
    """Points `(P, 3)` of a part's surface and their outward normals `(P, 3)`, in the part's frame."""

    points: np.ndarray
    normals: np.ndarray


class Whole(NamedTuple):
    """What the parts lie in. matched : whether parts lie against its wall, or it is only a bound."""

    wall: tuple
    matched: bool


class Placed(NamedTuple):
    """M placed parts: grids as `sdf.GridStack.arrays` has them, half_extents `(M, 3)` and radius `(M,)` of their boxes
    and spheres, rotation `(M, 3, 3)`, translation `(M, 3)`. Lengths in metres."""

    grids: tuple
    half_extents: np.ndarray
    radius: np.ndarray
    rotation: np.ndarray
    translation: np.ndarray


class Contact(NamedTuple):
    """When a point lies on a surface: nearer than `distance` metres, the cosine between normals above `cosine`."""

    distance: float
    cosine: float


@njit(cache=True, error_model="numpy", nogil=True)
def coverage(part, rotation, translation, whole, placed, skip, contact):
    """How much of a part's surface lies on others, and how much where it must not be, under each of B poses.

    part : a `Surface`. rotation `(B, 3, 3)`, translation `(B, 3)` metres. skip : the placed part that is not looked at,
    -1 for none. Returns two fractions of the part's points, `(B,)` each: covered, where a point counts the more the
    nearer it is, and outside, beyond a surface by more than the contact's distance.
    """
    covered, outside = np.zeros(len(rotation)), np.zeros(len(rotation))
    near, least = contact
    count, own = len(part.points), _radius(part.points)
    met = np.empty((1 + len(placed.radius), count, 5))
    for b in range(len(rotation)):
        others = _nearby(placed, skip, translation[b], own + near)
        _measure(part, rotation, translation, b, whole, placed, others, near, met)
        for p in range(count):
            best, leaves = 0.0, 0.0
            for m in range(1 + len(others)):
                beyond = met[m, p, 0]
                close = abs(beyond) < near
                if close and met[m, p, 4] > least:
                    best = max(best, 1 - abs(beyond) / near)
                if beyond > 0 and not close:
                    leaves = 1.0
            covered[b] += best
            outside[b] += leaves
        covered[b] /= count
        outside[b] /= count
    return covered, outside


@njit(cache=True, error_model="numpy", nogil=True)
def normal_equations(part, rotation, translation, whole, placed, skip, contact):
    """One step of least squares, point to plane, under each of B poses; arguments as of `coverage`.

    Rows are the points that lie on another surface, or beyond it, weighted by 1 / (1 + (distance / contact's)^2).
    Returns square `(B, 6, 6)` and slope `(B, 6)`, first the turn (radians, about the part's centre), then the shift
    (metres): the step solves square @ step = -slope. And rows `(B,)`, how many there are.
    """
    square, slope = np.zeros((len(rotation), 6, 6)), np.zeros((len(rotation), 6))
    rows, row = np.zeros(len(rotation)), np.empty(6)
    near, least = contact
    points, own = part.points, _radius(part.points)
    met = np.empty((1 + len(placed.radius), len(points), 5))
    for b in range(len(rotation)):
        others = _nearby(placed, skip, translation[b], own + near)
        _measure(part, rotation, translation, b, whole, placed, others, near, met)
        r = matrix(rotation, b)
        for p in range(len(points)):
            x, y, z = rotate(r, points[p, 0], points[p, 1], points[p, 2])
            for m in range(1 + len(others)):
                beyond, gx, gy, gz = met[m, p, 0], met[m, p, 1], met[m, p, 2], met[m, p, 3]
                if not (beyond > 0 or (abs(beyond) < near and met[m, p, 4] > least)):
                    continue
                row[0], row[1], row[2] = y * gz - z * gy, z * gx - x * gz, x * gy - y * gx
                row[3], row[4], row[5] = gx, gy, gz
                weight = 1 / (1 + (beyond / near) ** 2)
                rows[b] += 1
                for i in range(6):
                    slope[b, i] += weight * beyond * row[i]
                    for j in range(6):
                        square[b, i, j] += weight * row[i] * row[j]
    return square, slope, rows


@njit(cache=True, error_model="numpy", nogil=True)
def _measure(part, rotation, translation, pose, whole, placed, others, near, met):
    """Fill `met` `(1 + M, P, 5)`: each point against the wall, then against the placed parts numbered `others`.

    First how far the point is beyond that surface, in metres, where it must not be: outside the whole, inside a placed
    part; -inf, and nothing more, if the placed part's box is not near. Then the gradient of that, and the cosine
    between the gradient and the point's normal: 1 if the surfaces lie on each other.
    """
    points, normals = part  # tuples are taken apart first: a look into one at each point costs as much as the rest
    wall, matched = whole
    grids, half, _, turns, centres = placed
    r = matrix(rotation, pose)
    tx, ty, tz = translation[pose, 0], translation[pose, 1], translation[pose, 2]
    for p in range(len(points)):
        x, y, z = rotate(r, points[p, 0], points[p, 1], points[p, 2])
        nx, ny, nz = rotate(r, normals[p, 0], normals[p, 1], normals[p, 2])
        x, y, z = x + tx, y + ty, z + tz
        distance, gx, gy, gz = wall_distance(wall, x, y, z)
        met[0, p, 0], met[0, p, 1], met[0, p, 2], met[0, p, 3] = distance, gx, gy, gz
        met[0, p, 4] = nx * gx + ny * gy + nz * gz if matched else -1.0
        for m in range(len(others)):
            k = others[m]
            q = matrix(turns, k)
            lx, ly, lz = rotate_back(q, x - centres[k, 0], y - centres[k, 1], z - centres[k, 2])
            if abs(lx) >= half[k, 0] + near or abs(ly) >= half[k, 1] + near or abs(lz) >= half[k, 2] + near:
                met[m + 1, p, 0] = -math.inf
                continue
            distance, sx, sy, sz = sample_inline(grids, k, lx, ly, lz)
            gx, gy, gz = rotate(q, -sx, -sy, -sz)
            met[m + 1, p, 0], met[m + 1, p, 1], met[m + 1, p, 2], met[m + 1, p, 3] = -distance, gx, gy, gz
            met[m + 1, p, 4] = nx * gx + ny * gy + nz * gz


@njit(cache=True, error_model="numpy", nogil=True)
def _radius(points):
    """Of the smallest sphere about the origin that holds all points `(P, 3)`."""
    square = 0.0
    for p in range(len(points)):
        square = max(square, points[p, 0] ** 2 + points[p, 1] ** 2 + points[p, 2] ** 2)
    return math.sqrt(square)


@njit(cache=True, error_model="numpy", nogil=True)
def _nearby(placed, skip, t, reach):
    """Numbers of the placed parts whose sphere is nearer to `t` than `reach`."""
    found, count = np.empty(len(placed.radius), np.int64), 0
    for k in range(len(placed.radius)):
        x, y, z = t[0] - placed.translation[k, 0], t[1] - placed.translation[k, 1], t[2] - placed.translation[k, 2]
        if k != skip and x**2 + y**2 + z**2 < (reach + placed.radius[k]) ** 2:
            found[count] = k
            count += 1
    return found[:count]
