"""A part's surface against the surface of a whole and of placed parts, under many poses: compiled at first use.

`coverage` says how much of it lies there, `normal_equations` how to move it there (point to plane, Chen & Medioni).
The surfaces are signed distances: no pairs of points have to be found. A wall and grids are as in `grid`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from .grid import sample_inline, wall_distance

# written into the loops: a function that is given arrays for each point costs ten times as much
_inline = njit(inline="always", error_model="numpy")


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
    points, normals = part  # tuples are taken apart first: a look into one at each point costs as much as the rest
    wall, matched = whole
    grids, half, _, turns, centres = placed
    near, least = contact
    own = _radius(points)
    for b in range(len(rotation)):
        r, t = rotation[b], translation[b]
        others = _nearby(placed, skip, t, own + near)
        for p in range(len(points)):
            ax, ay, az = _turned(r, points, p)
            nx, ny, nz = _turned(r, normals, p)
            best, leaves = 0.0, 0.0
            for m in range(-1, len(others)):
                x, y, z = ax + t[0], ay + t[1], az + t[2]
                if m < 0:
                    distance, gx, gy, gz = wall_distance(wall, x, y, z)
                    cosine = nx * gx + ny * gy + nz * gz if matched else -1.0
                    wrong = distance > 0
                else:
                    distance, gx, gy, gz = _to_placed(grids, half, turns, centres, others[m], near, x, y, z)
                    cosine = -(nx * gx + ny * gy + nz * gz)
                    wrong = distance < 0
                close = abs(distance) < near
                if close and cosine > least:
                    best = max(best, 1 - abs(distance) / near)
                if wrong and not close:
                    leaves = 1.0
            covered[b] += best
            outside[b] += leaves
        covered[b] /= len(points)
        outside[b] /= len(points)
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
    points, normals = part
    wall, matched = whole
    grids, half, _, turns, centres = placed
    near, least = contact
    own = _radius(points)
    for b in range(len(rotation)):
        r, t = rotation[b], translation[b]
        others = _nearby(placed, skip, t, own + near)
        for p in range(len(points)):
            ax, ay, az = _turned(r, points, p)
            nx, ny, nz = _turned(r, normals, p)
            for m in range(-1, len(others)):
                x, y, z = ax + t[0], ay + t[1], az + t[2]
                if m < 0:
                    distance, gx, gy, gz = wall_distance(wall, x, y, z)
                    cosine = nx * gx + ny * gy + nz * gz if matched else -1.0
                    wrong = distance > 0
                else:
                    distance, gx, gy, gz = _to_placed(grids, half, turns, centres, others[m], near, x, y, z)
                    cosine = -(nx * gx + ny * gy + nz * gz)
                    wrong = distance < 0
                if not (wrong or (abs(distance) < near and cosine > least)):
                    continue
                row[0], row[1], row[2] = ay * gz - az * gy, az * gx - ax * gz, ax * gy - ay * gx
                row[3], row[4], row[5] = gx, gy, gz
                weight = 1 / (1 + (distance / near) ** 2)
                rows[b] += 1
                for i in range(6):
                    slope[b, i] += weight * distance * row[i]
                    for j in range(6):
                        square[b, i, j] += weight * row[i] * row[j]
    return square, slope, rows


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


@_inline
def _turned(r, rows, p):
    x, y, z = rows[p, 0], rows[p, 1], rows[p, 2]
    return (
        r[0, 0] * x + r[0, 1] * y + r[0, 2] * z,
        r[1, 0] * x + r[1, 1] * y + r[1, 2] * z,
        r[2, 0] * x + r[2, 1] * y + r[2, 2] * z,
    )


@_inline
def _to_placed(grids, half, r, t, k, near, x, y, z):
    """Signed distance of a world point to the placed part k, and its gradient; infinite if its box is not near."""
    dx, dy, dz = x - t[k, 0], y - t[k, 1], z - t[k, 2]
    lx = r[k, 0, 0] * dx + r[k, 1, 0] * dy + r[k, 2, 0] * dz
    ly = r[k, 0, 1] * dx + r[k, 1, 1] * dy + r[k, 2, 1] * dz
    lz = r[k, 0, 2] * dx + r[k, 1, 2] * dy + r[k, 2, 2] * dz
    distance, gx, gy, gz = math.inf, 0.0, 0.0, 0.0
    if abs(lx) < half[k, 0] + near and abs(ly) < half[k, 1] + near and abs(lz) < half[k, 2] + near:
        distance, sx, sy, sz = sample_inline(grids, k, lx, ly, lz)
        gx = r[k, 0, 0] * sx + r[k, 0, 1] * sy + r[k, 0, 2] * sz
        gy = r[k, 1, 0] * sx + r[k, 1, 1] * sy + r[k, 1, 2] * sz
        gz = r[k, 2, 0] * sx + r[k, 2, 1] * sy + r[k, 2, 2] * sz
    return distance, gx, gy, gz
