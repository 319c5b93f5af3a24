"""What the authors' published two-view run wrote: the losses that fall, as facts beside the kit's own.

Source: github.com/SoumyaratnaDebnath/RASP, the two-view run's `report/losses.csv`, every tenth of its 300 iterations
and the last, rounded; its settings are those of `config/twoView.py` beside it.
"""

from __future__ import annotations

import numpy as np

PIXELS, WEIGHT = 2 * 512**2, 0.5  # of two views, and of the silhouettes' sum over them
COUNT, ITERATIONS = 40, 300  # objects of Kitchen, and iterations
AZIMUTHS_DEG = (0.0, 120.0)
EDGE = 38 / 50  # metres: the container's edge is 38 steps of its lattice, and the objects are 50 times as large

# iteration, and the two terms with their weights
AT = (*range(0, 299, 10), 298)
# fmt: off
SILHOUETTE = (
    53640, 34776, 31906, 25550, 22533, 19731, 17812, 16065, 14735, 13676, 12673, 11972, 11596, 10877, 10210,
    9758, 9354, 9115, 8954, 8405, 8014, 7813, 7748, 7186, 7059, 6900, 7148, 6719, 6450, 6489, 6380,
)
OVERLAP = (
    4567, 1167, 498, 326, 209, 167, 140, 278, 150, 117, 73.4, 41.0, 75.1, 67.7, 44.2, 22.4, 15.4, 20.9, 38.4,
    64.0, 33.3, 74.3, 49.5, 83.1, 84.1, 93.3, 112, 31.0, 66.9, 49.2, 72.7,
)
# fmt: on


def silhouette() -> np.ndarray:
    """Eq. 2 at the iterations `AT`: a mean over pixels and views, dimensionless."""
    return np.array(SILHOUETTE) / (WEIGHT * PIXELS)
