"""Material splatted into slices, and the way back, in compiled loops. `slices` has the oracle in torch.

Arrays only, no tensors; workers as in `overlap`: each draws whole pictures, one view of one start after another.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from .frames import matrix, rotate


@njit(inline="always", error_model="numpy")
def _cell(r, place, centre, axes, x, y, z, scale, depth, n, layers):
    """The column, row and layer before a body's point in a view, by what share it lies beyond, and if it is seen."""
    wx, wy, wz = rotate(r, x, y, z)
    wx, wy, wz = wx + place[0] - centre[0], wy + place[1] - centre[1], wz + place[2] - centre[2]
    right = axes[0, 0] * wx + axes[0, 1] * wy + axes[0, 2] * wz
    up = axes[1, 0] * wx + axes[1, 1] * wy + axes[1, 2] * wz
    forward = axes[2, 0] * wx + axes[2, 1] * wy + axes[2, 2] * wz
    u, v = right * scale + n / 2 - 0.5, n / 2 - 0.5 - up * scale
    w = forward * depth + layers / 2 - 0.5 if layers > 1 else 0.0
    i, j, s = math.floor(u), math.floor(v), math.floor(w)
    return i, j, s, u - i, v - j, w - s, -1 < u < n and -1 < v < n and -1 < w < layers


@njit(cache=True, error_model="numpy", nogil=True)
def splat(worker, workers, points, first, volume, rotation, translation, axes, centres, widths, images):
    """Add each point's volume to `images` `(S * K, layers, n, n)`, shared out linearly over pixels and layers.

    Body i has the points `first[i]:first[i + 1]`, of `volume[i]` each.
    """
    layers, n = images.shape[1], images.shape[2]
    for job in range(worker, len(images), workers):
        one, k = job // len(widths), job % len(widths)
        image = images[job]
        scale, depth = n / widths[k], layers / widths[k]
        for body in range(len(first) - 1):
            r, place = matrix(rotation[one], body), translation[one, body]
            for p in range(first[body], first[body + 1]):
                x, y, z = points[p, 0], points[p, 1], points[p, 2]
                i, j, s, a, b, c, seen = _cell(r, place, centres[k], axes[k], x, y, z, scale, depth, n, layers)
                if not seen:
                    continue
                for layer in range(max(s, 0), min(s + 2, layers)):
                    in_layer = volume[body] * (c if layer > s else 1 - c)
                    for row in range(max(j, 0), min(j + 2, n)):
                        in_row = in_layer * (b if row > j else 1 - b)
                        for column in range(max(i, 0), min(i + 2, n)):
                            image[layer, row, column] += in_row * (a if column > i else 1 - a)


@njit(cache=True, error_model="numpy", nogil=True)
def pull(worker, workers, upstream, points, first, volume, rotation, translation, axes, centres, widths, wrench):
    """The way back: `wrench` `(S * K, N, 4, 3)`, each body's force and moments, from `upstream` like `images`."""
    layers, n = upstream.shape[1], upstream.shape[2]
    for job in range(worker, len(upstream), workers):
        one, k = job // len(widths), job % len(widths)
        image = upstream[job]
        scale, depth = n / widths[k], layers / widths[k]
        force = np.empty(3)
        for body in range(len(first) - 1):
            r, place, total = matrix(rotation[one], body), translation[one, body], wrench[job, body]
            for p in range(first[body], first[body + 1]):
                x, y, z = points[p, 0], points[p, 1], points[p, 2]
                i, j, s, a, b, c, seen = _cell(r, place, centres[k], axes[k], x, y, z, scale, depth, n, layers)
                if not seen:
                    continue
                du, dv, dw = 0.0, 0.0, 0.0
                for layer in range(max(s, 0), min(s + 2, layers)):
                    for row in range(max(j, 0), min(j + 2, n)):
                        for column in range(max(i, 0), min(i + 2, n)):
                            value = image[layer, row, column]
                            in_column, along = (a, 1.0) if column > i else (1 - a, -1.0)
                            in_row, down = (b, 1.0) if row > j else (1 - b, -1.0)
                            in_layer, behind = (c, 1.0) if layer > s else (1 - c, -1.0)
                            du += value * along * in_row * in_layer
                            dv += value * in_column * down * in_layer
                            dw += value * in_column * in_row * behind
                du, dv = du * scale * volume[body], -dv * scale * volume[body]
                dw = dw * depth * volume[body] if layers > 1 else 0.0
                for axis in range(3):
                    force[axis] = axes[k, 0, axis] * du + axes[k, 1, axis] * dv + axes[k, 2, axis] * dw
                    total[0, axis] += force[axis]
                for q in range(3):
                    for axis in range(3):
                        total[1 + q, axis] += points[p, q] * force[axis]
