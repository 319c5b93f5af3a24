"""How bodies in contact push each other: energy, forces and stiffness, compiled by numba at first use.

The energy is `contact.contact`'s: `sum over surface samples of area * depth^2`. Its Gauss-Newton system has a 6 x 6
block for each body (a shift, then a turn about its centre) and for each pair that touches. Samples lie in blocks,
balls of a few of them: a block further from a body than its radius is passed over. Arrays only, no tensors; `samples`
as `relaxing._in_blocks` has them, a wall as in `kernels_surface`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..geometry.sdf import NEAR
from .surface import _place, _to_wall


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
    r00, r01, r02 = rotation[other, 0, 0], rotation[other, 0, 1], rotation[other, 0, 2]
    r10, r11, r12 = rotation[other, 1, 0], rotation[other, 1, 1], rotation[other, 1, 2]
    r20, r21, r22 = rotation[other, 2, 0], rotation[other, 2, 1], rotation[other, 2, 2]
    q00, q01, q02 = rotation[own, 0, 0], rotation[own, 0, 1], rotation[own, 0, 2]
    q10, q11, q12 = rotation[own, 1, 0], rotation[own, 1, 1], rotation[own, 1, 2]
    q20, q21, q22 = rotation[own, 2, 0], rotation[own, 2, 1], rotation[own, 2, 2]
    cx, cy = translation[own, 0] - translation[other, 0], translation[own, 1] - translation[other, 1]
    cz = translation[own, 2] - translation[other, 2]
    # own's frame seen from other's
    s0, s1, s2 = r00 * cx + r10 * cy + r20 * cz, r01 * cx + r11 * cy + r21 * cz, r02 * cx + r12 * cy + r22 * cz
    t00, t01, t02 = (
        r00 * q00 + r10 * q10 + r20 * q20,
        r00 * q01 + r10 * q11 + r20 * q21,
        r00 * q02 + r10 * q12 + r20 * q22,
    )
    t10, t11, t12 = (
        r01 * q00 + r11 * q10 + r21 * q20,
        r01 * q01 + r11 * q11 + r21 * q21,
        r01 * q02 + r11 * q12 + r21 * q22,
    )
    t20, t21, t22 = (
        r02 * q00 + r12 * q10 + r22 * q20,
        r02 * q01 + r12 * q11 + r22 * q21,
        r02 * q02 + r12 * q12 + r22 * q22,
    )
    energy = 0.0
    for block in range(first_block[own], first_block[own + 1]):
        x, y, z, far = centres[block, 0], centres[block, 1], centres[block, 2], radii[block] + near
        px = (t00 * x + t01 * y + t02 * z + s0 - ox) * per
        py = (t10 * x + t11 * y + t12 * z + s1 - oy) * per
        pz = (t20 * x + t21 * y + t22 * z + s2 - oz) * per
        if max(-px, -py, -pz, px - nx + 1, py - ny + 1, pz - nz + 1) * cell > far:
            continue
        i = min(max(int(px + 0.5), 0), nx - 1)
        j = min(max(int(py + 0.5), 0), ny - 1)
        k = min(max(int(pz + 0.5), 0), nz - 1)
        if values[begin + (i * ny + j) * nz + k] > far + NEAR * cell:
            continue
        for sample in range(first[block], first[block + 1]):
            x, y, z = points[sample, 0], points[sample, 1], points[sample, 2]
            rx, ry, rz = t00 * x + t01 * y + t02 * z, t10 * x + t11 * y + t12 * z, t20 * x + t21 * y + t22 * z
            # trilinear as in `kernels_surface._sample`, which costs ten times as much where it is called
            px, py, pz = (rx + s0 - ox) * per, (ry + s1 - oy) * per, (rz + s2 - oz) * per
            ix, iy, iz = min(max(px, 0.0), nx - 1.0), min(max(py, 0.0), ny - 1.0), min(max(pz, 0.0), nz - 1.0)
            bx, by, bz = (px - ix) * cell, (py - iy) * cell, (pz - iz) * cell
            beyond = math.sqrt(bx * bx + by * by + bz * bz)
            if beyond > near:
                continue
            i, j, k = min(int(ix), nx - 2), min(int(iy), ny - 2), min(int(iz), nz - 2)
            fx, fy, fz = ix - i, iy - j, iz - k
            o = begin + (i * ny + j) * nz + k
            p = o + ny * nz
            v000, v001, v010, v011 = values[o], values[o + 1], values[o + nz], values[o + nz + 1]
            v100, v101, v110, v111 = values[p], values[p + 1], values[p + nz], values[p + nz + 1]
            c00, c01 = v000 + fx * (v100 - v000), v001 + fx * (v101 - v001)
            c10, c11 = v010 + fx * (v110 - v010), v011 + fx * (v111 - v011)
            c0, c1 = c00 + fy * (c10 - c00), c01 + fy * (c11 - c01)
            depth = near - (c0 + fz * (c1 - c0) + beyond)
            if depth <= 0:
                continue
            d0, d1 = (v100 - v000) * (1 - fy) + (v110 - v010) * fy, (v101 - v001) * (1 - fy) + (v111 - v011) * fy
            gx, gy, gz = (
                (d0 + fz * (d1 - d0)) / cell,
                ((c10 - c00) * (1 - fz) + (c11 - c01) * fz) / cell,
                (c1 - c0) / cell,
            )
            if beyond > 0:
                gx, gy, gz = bx / beyond if bx else gx, by / beyond if by else gy, bz / beyond if bz else gz
            wx, wy, wz = r00 * gx + r01 * gy + r02 * gz, r10 * gx + r11 * gy + r12 * gz, r20 * gx + r21 * gy + r22 * gz
            rx, ry, rz = q00 * x + q01 * y + q02 * z, q10 * x + q11 * y + q12 * z, q20 * x + q21 * y + q22 * z
            energy += _press(area[sample], depth, rx, ry, rz, wx, wy, wz, moment, pull)
    return energy


@njit(cache=True, error_model="numpy", nogil=True, inline="always")
def _press(area, depth, rx, ry, rz, gx, gy, gz, moment, pull):
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
    """What the samples of a body have beyond the wall: the energy; `moment` and `pull` in the world."""
    points, area, first, centres, radii, first_block = samples
    a_box = len(wall[0]) > 0
    hx, hy, hz = (wall[0][0], wall[0][1], wall[0][2]) if a_box else (0.0, 0.0, 0.0)
    energy = 0.0
    for block in range(first_block[own], first_block[own + 1]):
        wx, wy, wz = _place(rotation, translation, centres[block, 0], centres[block, 1], centres[block, 2])
        far = -near - radii[block]
        if (max(abs(wx) - hx, abs(wy) - hy, abs(wz) - hz) if a_box else _to_wall(wall, wx, wy, wz)[0]) < far:
            continue
        for sample in range(first[block], first[block + 1]):
            wx, wy, wz = _place(rotation, translation, points[sample, 0], points[sample, 1], points[sample, 2])
            if a_box and max(abs(wx) - hx, abs(wy) - hy, abs(wz) - hz) < -near:
                continue  # for speed alone
            value, gx, gy, gz = _to_wall(wall, wx, wy, wz)
            if value + near > 0:
                r = wx - translation[0], wy - translation[1], wz - translation[2]
                energy += _press(area[sample], value + near, r[0], r[1], r[2], -gx, -gy, -gz, moment, pull)
    return energy


@njit(cache=True, error_model="numpy", nogil=True)
def system(wall, grids, samples, half, radius, weight, rotation, translation, margin, blocks):
    """Energy and Gauss-Newton system at these poses; returns the energy and how many pairs touch.

    weight `(N,)`: what two bodies share counts by the mean of theirs, what is beyond the wall by the body's own.
    blocks: diagonal `(N, 6, 6)`, its lower halves; coupling `(P, 6, 6)` and pairs `(P, 2)`, with room for all pairs;
    pull `(N, 6)`; each body's share `(N,)` of the energy.
    """
    diagonal, coupling, pairs, pull, share = blocks
    bodies, energy, touching = len(half), 0.0, 0
    diagonal[:], pull[:], share[:] = 0.0, 0.0, 0.0
    boxes, moment, force = np.empty((bodies, 3)), np.empty((6, 6)), np.empty(6)
    for body in range(bodies):
        for a in range(3):
            boxes[body, a] = 0.0
            for c in range(3):
                boxes[body, a] += abs(rotation[body, a, c]) * half[body, c]
    for body in range(bodies):
        if _to_wall(wall, translation[body, 0], translation[body, 1], translation[body, 2])[0] + radius[body] < -margin:
            continue
        moment[:], force[:] = 0.0, 0.0
        found = _by_wall(wall, samples, body, rotation[body], translation[body], margin, moment, force)
        share[body] += weight[body] * found
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
                share[one] += found / 2
                share[two] += found / 2
                pairs[touching, 0], pairs[touching, 1] = one, two
                touching += 1
    return energy, touching
