"""How often a closed surface goes round points: exact, at a cost of all its faces a point; compiled at first use."""

from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def winding_numbers(vertices, faces, points):
    """Of points `(M, 3)`, by a surface `(V, 3)` and `(F, 3)`: 1 inside, 0 outside, `(M,)`.

    The sum of the faces' solid angles over 4 pi (van Oosterom & Strackee 1983).
    """
    found = np.empty(len(points))
    for k in range(len(points)):
        x, y, z = points[k]
        total = 0.0
        for f in range(len(faces)):
            i, j, n = faces[f]
            ax, ay, az = vertices[i, 0] - x, vertices[i, 1] - y, vertices[i, 2] - z
            bx, by, bz = vertices[j, 0] - x, vertices[j, 1] - y, vertices[j, 2] - z
            cx, cy, cz = vertices[n, 0] - x, vertices[n, 1] - y, vertices[n, 2] - z
            a = math.sqrt(ax * ax + ay * ay + az * az)
            b = math.sqrt(bx * bx + by * by + bz * bz)
            c = math.sqrt(cx * cx + cy * cy + cz * cz)
            volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
            ab, bc, ca = ax * bx + ay * by + az * bz, bx * cx + by * cy + bz * cz, cx * ax + cy * ay + cz * az
            total += math.atan2(volume, a * b * c + ab * c + bc * a + ca * b)
        found[k] = total / (2 * math.pi)
    return found
