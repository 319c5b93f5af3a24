"""How bodies in contact push each other: energy, forces and stiffness, compiled by numba at first use.

The energy is that of `surface_contact`, `sum over surface samples of area * depth^2`. Its Gauss-Newton system has a
6 x 6 block for each body (a shift, then a turn about its centre) and for each pair that touches. Samples lie in blocks,
balls of a few of them: a block further from a body than its radius is passed over. Arrays only, no tensors; `samples`
as `packing.contact_solver._in_blocks` has them, grids and walls as in `grid`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..geometry.sdf import NEAR
from .frames import matrix, relative, rotate, rotate_back
from .grid import cell_along, nearest_along, outward, trilinear, wall_distance


@njit(cache=True, error_model="numpy", nogil=True)
def _pair(grids, samples, other, own, rotation, translation, near, moment, pull):
    """What the samples of body `own` share with body `other`: the energy, and what it adds to `moment` `(6, 6)`, its
    lower half, and `pull` `(6,)`, turns about the centre of `own`."""
    points, area, first, centres, radii, first_block = samples
    values, starts, shapes, origins, spacings = grids
    cell, begin = spacings[other], starts[other]
    per = 1 / cell
    nx, ny, nz = shapes[other, 0], shapes[other, 1], shapes[other, 2]
    ox, oy, oz = origins[other, 0], origins[other, 1], origins[other, 2]
    r, q = matrix(rotation, other), matrix(rotation, own)
    # own's frame seen from other's
    turn = relative(r, q)
    sx, sy, sz = rotate_back(
        r,
        translation[own, 0] - translation[other, 0],
        translation[own, 1] - translation[other, 1],
        translation[own, 2] - translation[other, 2],
    )
    energy = 0.0
    for block in range(first_block[own], first_block[own + 1]):
        far = radii[block] + near
        x, y, z = rotate(turn, centres[block, 0], centres[block, 1], centres[block, 2])
        px, py, pz = (x + sx - ox) * per, (y + sy - oy) * per, (z + sz - oz) * per
        if max(-px, -py, -pz, px - nx + 1, py - ny + 1, pz - nz + 1) * cell > far:
            continue
        i, j, k = nearest_along(px, nx), nearest_along(py, ny), nearest_along(pz, nz)
        if values[begin + (i * ny + j) * nz + k] > far + NEAR * cell:
            continue
        for sample in range(first[block], first[block + 1]):
            x, y, z = rotate(turn, points[sample, 0], points[sample, 1], points[sample, 2])
            i, fx, bx = cell_along((x + sx - ox) * per, nx)
            j, fy, by = cell_along((y + sy - oy) * per, ny)
            k, fz, bz = cell_along((z + sz - oz) * per, nz)
            bx, by, bz = bx * cell, by * cell, bz * cell
            beyond = math.sqrt(bx * bx + by * by + bz * bz)
            if beyond > near:
                continue
            value, gx, gy, gz = trilinear(values, begin + (i * ny + j) * nz + k, ny * nz, nz, fx, fy, fz)
            depth = near - (value + beyond)
            if depth <= 0:
                continue
            gx, gy, gz = outward(beyond, bx, by, bz, gx / cell, gy / cell, gz / cell)
            wx, wy, wz = rotate(r, gx, gy, gz)
            ax, ay, az = rotate(q, points[sample, 0], points[sample, 1], points[sample, 2])
            energy += _add_sample(area[sample], depth, ax, ay, az, wx, wy, wz, moment, pull)
    return energy


@njit(cache=True, error_model="numpy", nogil=True, inline="always")
def _add_sample(area, depth, rx, ry, rz, gx, gy, gz, moment, pull):
    """Add a sample at r from its body's centre, which a shift along g takes out; its energy."""
    w0, w1, w2 = -gx, -gy, -gz
    w3, w4, w5 = gy * rz - gz * ry, gz * rx - gx * rz, gx * ry - gy * rx
    a0, a1, a2, a3, a4, a5 = area * w0, area * w1, area * w2, area * w3, area * w4, area * w5
    pull[0] += a0 * depth
    pull[1] += a1 * depth
    pull[2] += a2 * depth
    pull[3] += a3 * depth
    pull[4] += a4 * depth
    pull[5] += a5 * depth
    moment[0, 0] += a0 * w0
    moment[1, 0] += a1 * w0
    moment[1, 1] += a1 * w1
    moment[2, 0] += a2 * w0
    moment[2, 1] += a2 * w1
    moment[2, 2] += a2 * w2
    moment[3, 0] += a3 * w0
    moment[3, 1] += a3 * w1
    moment[3, 2] += a3 * w2
    moment[3, 3] += a3 * w3
    moment[4, 0] += a4 * w0
    moment[4, 1] += a4 * w1
    moment[4, 2] += a4 * w2
    moment[4, 3] += a4 * w3
    moment[4, 4] += a4 * w4
    moment[5, 0] += a5 * w0
    moment[5, 1] += a5 * w1
    moment[5, 2] += a5 * w2
    moment[5, 3] += a5 * w3
    moment[5, 4] += a5 * w4
    moment[5, 5] += a5 * w5
    return area * depth * depth


@njit(cache=True, error_model="numpy", nogil=True)
def _by_wall(wall, samples, own, rotation, translation, near, moment, pull):
    """What the samples of body `own` have beyond the wall: the energy; `moment` and `pull` in the world."""
    points, area, first, centres, radii, first_block = samples
    a_box = len(wall[0]) > 0
    hx, hy, hz = (wall[0][0], wall[0][1], wall[0][2]) if a_box else (0.0, 0.0, 0.0)
    r, tx, ty, tz = matrix(rotation, own), translation[own, 0], translation[own, 1], translation[own, 2]
    energy = 0.0
    for block in range(first_block[own], first_block[own + 1]):
        x, y, z = rotate(r, centres[block, 0], centres[block, 1], centres[block, 2])
        wx, wy, wz = x + tx, y + ty, z + tz
        far = -near - radii[block]
        if (max(abs(wx) - hx, abs(wy) - hy, abs(wz) - hz) if a_box else wall_distance(wall, wx, wy, wz)[0]) < far:
            continue
        for sample in range(first[block], first[block + 1]):
            x, y, z = rotate(r, points[sample, 0], points[sample, 1], points[sample, 2])
            wx, wy, wz = x + tx, y + ty, z + tz
            if a_box and max(abs(wx) - hx, abs(wy) - hy, abs(wz) - hz) < -near:
                continue  # for speed alone
            value, gx, gy, gz = wall_distance(wall, wx, wy, wz)
            if value + near > 0:
                ax, ay, az = wx - tx, wy - ty, wz - tz
                energy += _add_sample(area[sample], value + near, ax, ay, az, -gx, -gy, -gz, moment, pull)
    return energy


@njit(cache=True, error_model="numpy", nogil=True)
def system(wall, grids, samples, half, radius, weight, rotation, translation, margin, blocks):
    """Energy and Gauss-Newton system at these poses; returns the energy and how many pairs touch.

    weight `(N,)`: what two bodies share counts by the mean of theirs, what is beyond the wall by the body's own.
    blocks: diagonal `(N, 6, 6)`, its lower halves; coupling `(P, 6, 6)` and pairs `(P, 2)`, with room for all pairs;
    pull `(N, 6)`; energy_of_body `(N,)`, each body's part of it.
    """
    diagonal, coupling, pairs, pull, energy_of_body = blocks
    bodies, energy, touching = len(half), 0.0, 0
    diagonal[:], pull[:], energy_of_body[:] = 0.0, 0.0, 0.0
    boxes, moment, force = np.empty((bodies, 3)), np.empty((6, 6)), np.empty(6)
    for body in range(bodies):
        for a in range(3):
            boxes[body, a] = 0.0
            for c in range(3):
                boxes[body, a] += abs(rotation[body, a, c]) * half[body, c]
    for body in range(bodies):
        x, y, z = translation[body, 0], translation[body, 1], translation[body, 2]
        if wall_distance(wall, x, y, z)[0] + radius[body] < -margin:
            continue
        moment[:], force[:] = 0.0, 0.0
        found = _by_wall(wall, samples, body, rotation, translation, margin, moment, force)
        energy_of_body[body] += weight[body] * found
        energy += weight[body] * found
        for i in range(6):
            pull[body, i] += weight[body] * force[i]
            for j in range(i + 1):
                diagonal[body, i, j] += weight[body] * moment[i, j]
    for one in range(bodies):
        for two in range(one):
            apart = False
            for a in range(3):
                if abs(translation[one, a] - translation[two, a]) > boxes[one, a] + boxes[two, a] + 2 * margin:
                    apart = True
            if apart:
                continue
            found = 0.0
            coupling[touching] = 0.0
            for own, other in ((one, two), (two, one)):
                moment[:], force[:] = 0.0, 0.0
                shared = _pair(grids, samples, other, own, rotation, translation, 2 * margin, moment, force)
                if shared == 0.0:
                    continue
                heavy = (weight[one] + weight[two]) / 2
                found += heavy * shared
                for i in range(6):
                    force[i] *= heavy
                    for j in range(i + 1):
                        moment[i, j] *= heavy
                c = translation[own] - translation[other]
                for i in range(6):
                    pull[own, i] += force[i]
                    pull[other, i] -= force[i]
                    for j in range(i + 1):
                        moment[j, i] = moment[i, j]
                        diagonal[own, i, j] += moment[i, j]
                # the same forces act against the other, about its own centre
                for i in range(3):
                    y, z = (i + 1) % 3, (i + 2) % 3
                    pull[other, 3 + i] -= c[y] * force[z] - c[z] * force[y]
                    for j in range(6):
                        moment[3 + i, j] += c[y] * moment[z, j] - c[z] * moment[y, j]
                for i in range(6):
                    for j in range(6):
                        if own == one:
                            coupling[touching, j, i] -= moment[i, j]
                        else:
                            coupling[touching, i, j] -= moment[i, j]
                for i in range(6):
                    for j in range(3):
                        y, z = (j + 1) % 3, (j + 2) % 3
                        moment[i, 3 + j] += moment[i, z] * c[y] - moment[i, y] * c[z]
                for i in range(6):
                    for j in range(i + 1):
                        diagonal[other, i, j] += moment[i, j]
            if found > 0.0:
                energy += found
                energy_of_body[one] += found / 2
                energy_of_body[two] += found / 2
                pairs[touching, 0], pairs[touching, 1] = one, two
                touching += 1
    return energy, touching
