"""Which of many poses are the same as a better one: compiled at first use."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy", nogil=True)
def distinct(rotation, translation, cosine, distance, count):
    """Indices of the first poses that are not the same as an earlier one among them, `count` at most.

    rotation `(B, 3, 3)`, translation `(B, 3)` metres. Two are the same if the cosine of the angle between them is at
    least `cosine` and they are no further than `distance` metres apart.
    """
    kept, found = np.empty(count, np.int64), 0
    for i in range(len(rotation)):
        if found == count:
            break
        fresh = True
        for n in range(found):
            k, square, trace = kept[n], 0.0, 0.0
            for x in range(3):
                square += (translation[i, x] - translation[k, x]) ** 2
            if square > distance**2:
                continue
            for x in range(3):
                for y in range(3):
                    trace += rotation[i, x, y] * rotation[k, x, y]
            if (trace - 1) / 2 >= cosine:
                fresh = False
                break
        if fresh:
            kept[found] = i
            found += 1
    return kept[:found]
