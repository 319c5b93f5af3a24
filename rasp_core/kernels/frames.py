"""Rotations and forces in compiled loops. A rotation is nine numbers, row by row, that the compiler keeps in registers.

All of it is written into the loops that call it (`inline="always"`): a function that is given arrays for each point
costs ten times as much. Rotations map body to world, as in `poses`.
"""

from __future__ import annotations

from numba import njit


@njit(inline="always", error_model="numpy")
def matrix(rotation, body):
    """The rotation of one body, of an array `(N, 3, 3)`."""
    return (
        rotation[body, 0, 0],
        rotation[body, 0, 1],
        rotation[body, 0, 2],
        rotation[body, 1, 0],
        rotation[body, 1, 1],
        rotation[body, 1, 2],
        rotation[body, 2, 0],
        rotation[body, 2, 1],
        rotation[body, 2, 2],
    )


@njit(inline="always", error_model="numpy")
def rotate(r, x, y, z):
    """`R v`: a direction of the body's frame, in the world."""
    return r[0] * x + r[1] * y + r[2] * z, r[3] * x + r[4] * y + r[5] * z, r[6] * x + r[7] * y + r[8] * z


@njit(inline="always", error_model="numpy")
def rotate_back(r, x, y, z):
    """`R^T v`: a direction of the world, in the body's frame."""
    return r[0] * x + r[3] * y + r[6] * z, r[1] * x + r[4] * y + r[7] * z, r[2] * x + r[5] * y + r[8] * z


@njit(inline="always", error_model="numpy")
def relative(r, q):
    """`R^T Q`: the rotation from the frame of q to that of r."""
    a, d, g = rotate_back(r, q[0], q[3], q[6])
    b, e, h = rotate_back(r, q[1], q[4], q[7])
    c, f, i = rotate_back(r, q[2], q[5], q[8])
    return a, b, c, d, e, f, g, h, i


@njit(inline="always", error_model="numpy")
def add_wrench(sums, value, x, y, z, fx, fy, fz):
    """Add a value, and a force at a point of the body's frame, to `sums` `(13,)`, see `wrenches.from_sums`."""
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
