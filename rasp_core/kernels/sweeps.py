"""What a solid meets on a straight way, in a compiled loop: exact, for the whole way and not for samples of it.

A solid that moves along z sweeps over all that lies above its underside. What of another solid lies there is a sum over
pairs of triangles, one of the underside and one of the other's surface: the volume between them where, seen along z,
the other is above. The other's triangles that face up count, those that face down are taken off.
"""

from __future__ import annotations

import numpy as np
from numba import njit

MOST_CORNERS = 16  # of two triangles' common polygon there are six, and one more where it is cut
FLAT = 1e-12  # of its longest edge squared: a triangle of no more area, seen along z, has none


@njit(cache=True, error_model="numpy", nogil=True)
def swept(lower, surface, facing, most):
    """Cubic metres of a solid above the triangles `lower` `(P, 3, 3)` of another's underside; infinite above `most`.

    surface `(Q, 3, 3)`, facing `(Q,)`: the solid's triangles, and of each what `facing_up` says; seen along z none is a
    line. Both are in the order of their lowest x. It is what the other sweeps over on its way along z; where its
    underside has several layers above each other, what lies above each counts.
    """
    total, widest, start = 0.0, 0.0, 0
    boxes, box = np.empty((len(surface), 5)), np.empty(5)
    whole = np.array([np.inf, -np.inf, np.inf, -np.inf, -np.inf])
    for q in range(len(surface)):
        _extent(surface[q], boxes[q])
        boxes[q, 4] = max(surface[q, 0, 2], surface[q, 1, 2], surface[q, 2, 2])
        widest = max(widest, boxes[q, 1] - boxes[q, 0])
        for end in range(5):
            whole[end] = min(whole[end], boxes[q, end]) if end in (0, 2) else max(whole[end], boxes[q, end])
    polygon, cut, depth = np.empty((MOST_CORNERS, 2)), np.empty((MOST_CORNERS, 2)), np.empty(MOST_CORNERS)
    for p in range(len(lower)):
        _extent(lower[p], box)
        if box[4] >= whole[4] or box[0] >= whole[1] or box[1] <= whole[0] or box[2] >= whole[3] or box[3] <= whole[2]:
            continue
        while start < len(surface) and boxes[start, 0] < box[0] - widest:
            start += 1
        for q in range(start, len(surface)):
            other = boxes[q]
            if other[0] >= box[1]:
                break
            if box[4] >= other[4] or box[0] >= other[1] or box[2] >= other[3] or box[3] <= other[2]:
                continue
            total += facing[q] * _between(lower[p], surface[q], polygon, cut, depth)
        if total > most:  # what lies above one triangle of the underside is never less than nothing
            return np.inf
    return total


@njit(cache=True, error_model="numpy", nogil=True)
def facing_up(corners):
    """`(F,)`: 1 for each triangle of `corners` `(F, 3, 3)` that faces up, -1 down, 0 if seen along z it is a line."""
    sides = np.zeros(len(corners), np.int8)
    for f in range(len(corners)):
        a, b, c = corners[f, 0], corners[f, 1], corners[f, 2]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        longest = 0.0
        for k in range(3):
            edge = corners[f, (k + 1) % 3] - corners[f, k]
            longest = max(longest, edge[0] * edge[0] + edge[1] * edge[1] + edge[2] * edge[2])
        if area > FLAT * longest:
            sides[f] = 1
        elif area < -FLAT * longest:
            sides[f] = -1
    return sides


@njit(cache=True, error_model="numpy", nogil=True)
def _extent(corners, box):
    """Lowest and highest x, then y, then the lowest z."""
    for axis in range(2):
        box[2 * axis] = min(corners[0, axis], corners[1, axis], corners[2, axis])
        box[2 * axis + 1] = max(corners[0, axis], corners[1, axis], corners[2, axis])
    box[4] = min(corners[0, 2], corners[1, 2], corners[2, 2])


@njit(cache=True, error_model="numpy", nogil=True)
def _between(one, other, polygon, cut, depth):
    """Cubic metres between a triangle and another, where that is above it."""
    count = 3
    for k in range(3):
        polygon[k, 0], polygon[k, 1] = other[k, 0], other[k, 1]
    turn = (one[1, 0] - one[0, 0]) * (one[2, 1] - one[0, 1]) - (one[1, 1] - one[0, 1]) * (one[2, 0] - one[0, 0])
    sign = 1.0 if turn > 0 else -1.0
    for k in range(3):
        ax, ay = one[k, 0], one[k, 1]
        dx, dy = sign * (one[(k + 1) % 3, 0] - ax), sign * (one[(k + 1) % 3, 1] - ay)
        for c in range(count):
            depth[c] = dx * (polygon[c, 1] - ay) - dy * (polygon[c, 0] - ax)
        count = _cut(polygon, count, depth, cut)
        if count < 3:
            return 0.0
    for c in range(count):
        x, y = polygon[c, 0], polygon[c, 1]
        depth[c] = _height(other, x, y) - _height(one, x, y)
    count = _cut(polygon, count, depth, cut)
    if count < 3:
        return 0.0
    volume, x, y = 0.0, polygon[0, 0], polygon[0, 1]
    for c in range(1, count - 1):
        across = (polygon[c, 0] - x) * (polygon[c + 1, 1] - y) - (polygon[c, 1] - y) * (polygon[c + 1, 0] - x)
        volume += abs(across) / 6 * (depth[0] + depth[c] + depth[c + 1])
    return volume


@njit(cache=True, error_model="numpy", nogil=True)
def _cut(polygon, count, depth, cut):
    """Keep of a convex polygon what has `depth` above 0, which is linear; `depth` is then that of the new corners."""
    kept = 0
    new = np.empty(MOST_CORNERS)
    for c in range(count):
        n = (c + 1) % count
        if depth[c] > 0:
            cut[kept, 0], cut[kept, 1], new[kept] = polygon[c, 0], polygon[c, 1], depth[c]
            kept += 1
        if (depth[c] > 0) != (depth[n] > 0):
            share = depth[c] / (depth[c] - depth[n])
            for axis in range(2):
                cut[kept, axis] = polygon[c, axis] + share * (polygon[n, axis] - polygon[c, axis])
            new[kept] = 0.0
            kept += 1
    for c in range(kept):
        polygon[c, 0], polygon[c, 1], depth[c] = cut[c, 0], cut[c, 1], new[c]
    return kept


@njit(cache=True, error_model="numpy", nogil=True)
def _height(corners, x, y):
    """z of a triangle's plane at x, y."""
    ux, uy, uz = corners[1, 0] - corners[0, 0], corners[1, 1] - corners[0, 1], corners[1, 2] - corners[0, 2]
    vx, vy, vz = corners[2, 0] - corners[0, 0], corners[2, 1] - corners[0, 1], corners[2, 2] - corners[0, 2]
    area, px, py = ux * vy - uy * vx, x - corners[0, 0], y - corners[0, 1]
    return corners[0, 2] + ((px * vy - py * vx) * uz + (ux * py - uy * px) * vz) / area
