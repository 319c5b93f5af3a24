"""Signed distances in compiled loops: of bodies and of containers, trilinear in their grids.

`geometry.sdf.GridStack` and `geometry.containers.Container` are the oracles. Grids are as `GridStack.arrays` has them,
`(values, start, shape, origin, spacing)`; a wall is as `Container.arrays` has it, `(half, centre, grid)`: half `(3,)`
of a box about the origin, else of length 0; the grid of a mesh in a frame about centre.
"""

from __future__ import annotations

import math

from numba import njit


@njit(inline="always", error_model="numpy")
def trilinear(values, corner, stride_x, stride_y, fx, fy, fz):
    """Value at the fractions fx, fy, fz of a cell, and its slope along x, y and z for each cell.

    corner : where the cell's lowest corner stands in `values`. stride_x, stride_y : from there to the next along x, y.
    Written into the loops that call it: they may leave out the slopes.
    """
    o = corner
    p = o + stride_x
    c00 = values[o] + fx * (values[p] - values[o])
    c01 = values[o + 1] + fx * (values[p + 1] - values[o + 1])
    c10 = values[o + stride_y] + fx * (values[p + stride_y] - values[o + stride_y])
    c11 = values[o + stride_y + 1] + fx * (values[p + stride_y + 1] - values[o + stride_y + 1])
    c0, c1 = c00 + fy * (c10 - c00), c01 + fy * (c11 - c01)
    d0 = (values[p] - values[o]) * (1 - fy) + (values[p + stride_y] - values[o + stride_y]) * fy
    d1 = (values[p + 1] - values[o + 1]) * (1 - fy) + (values[p + stride_y + 1] - values[o + stride_y + 1]) * fy
    return c0 + fz * (c1 - c0), d0 + fz * (d1 - d0), (c10 - c00) * (1 - fz) + (c11 - c01) * fz, c1 - c0


@njit(inline="always", error_model="numpy")
def cell_along(position, count):
    """Along one axis of a grid of `count` values: the nearest cell's index, the fraction of it, and how far beyond the
    grid the position lies; positions in cells."""
    inside = min(max(position, 0.0), count - 1.0)
    index = min(int(inside), count - 2)
    return index, inside - index, position - inside


@njit(inline="always", error_model="numpy")
def nearest_along(position, count):
    """Index of the value next to a position, in cells, along an axis of `count` values; at the border beyond it."""
    return min(max(int(position + 0.5), 0), count - 1)


@njit(inline="always", error_model="numpy")
def outward(beyond, bx, by, bz, sx, sy, sz):
    """The gradient beyond a grid: along the axes that were clamped the distance to the grid grows, and the value stays.

    b : from the grid to the point, `beyond` metres; s : the gradient at the grid's border."""
    if beyond > 0:
        sx, sy, sz = bx / beyond if bx else sx, by / beyond if by else sy, bz / beyond if bz else sz
    return sx, sy, sz


@njit(inline="always", error_model="numpy")
def sample_inline(grids, body, x, y, z):
    """Signed distance at a place in a body's frame and its gradient, as `GridStack.sample` has them."""
    values, starts, shapes, origins, spacings = grids
    cell, nx, ny, nz = spacings[body], shapes[body, 0], shapes[body, 1], shapes[body, 2]
    i, fx, bx = cell_along((x - origins[body, 0]) / cell, nx)
    j, fy, by = cell_along((y - origins[body, 1]) / cell, ny)
    k, fz, bz = cell_along((z - origins[body, 2]) / cell, nz)
    bx, by, bz = bx * cell, by * cell, bz * cell
    value, sx, sy, sz = trilinear(values, starts[body] + (i * ny + j) * nz + k, ny * nz, nz, fx, fy, fz)
    beyond = math.sqrt(bx * bx + by * by + bz * bz)
    sx, sy, sz = outward(beyond, bx, by, bz, sx / cell, sy / cell, sz / cell)
    return value + beyond, sx, sy, sz


@njit(cache=True, error_model="numpy", nogil=True)
def sample(grids, body, x, y, z):
    """`sample_inline`, called: less to compile, where it is not called for each of many points."""
    return sample_inline(grids, body, x, y, z)


@njit(cache=True, error_model="numpy", nogil=True)
def wall_distance(wall, x, y, z):
    """Distance to a container's wall, negative inside, and its gradient, as `Container.signed_distance` has them."""
    half, centre, grid = wall
    if len(half) == 0:
        return sample(grid, 0, x - centre[0], y - centre[1], z - centre[2])
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
def negative(values, turn, first, found):
    """Where a grid `values` `(X, Y, Z)` is negative, at the places `turn @ index + first`, in cells, of each index of
    `found`, bool of any shape with three axes; False beyond the grid."""
    nx, ny, nz = values.shape
    flat = values.ravel()
    for i in range(found.shape[0]):
        for j in range(found.shape[1]):
            for k in range(found.shape[2]):
                x = turn[0, 0] * i + turn[0, 1] * j + turn[0, 2] * k + first[0]
                y = turn[1, 0] * i + turn[1, 1] * j + turn[1, 2] * k + first[1]
                z = turn[2, 0] * i + turn[2, 1] * j + turn[2, 2] * k + first[2]
                inside = 0 <= x <= nx - 1 and 0 <= y <= ny - 1 and 0 <= z <= nz - 1
                if inside:
                    a, fx, _ = cell_along(x, nx)
                    b, fy, _ = cell_along(y, ny)
                    c, fz, _ = cell_along(z, nz)
                    inside = trilinear(flat, (a * ny + b) * nz + c, ny * nz, nz, fx, fy, fz)[0] < 0
                found[i, j, k] = inside
