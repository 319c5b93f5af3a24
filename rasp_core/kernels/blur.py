"""Images blurred along rows and columns in compiled loops; `silhouettes.soften` has the oracle in torch.

A function that takes `worker` and `workers` blurs its rows, see `dispatch.in_parallel`.
"""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True, fastmath=True)
def _add(target, source, weight):
    """`target += weight * source`, in a form that compiles to vector instructions."""
    for x in range(len(target)):
        target[x] += weight * source[x]


@njit(cache=True, nogil=True)
def along_rows(worker, workers, images, kernel, out):
    """Images `(K, H, W)` blurred along their rows with an odd, symmetric kernel, 0 beyond the border; added to out."""
    views, height, width = images.shape
    reach = len(kernel) // 2
    for job in range(worker, views * height, workers):
        k, row = job // height, job % height
        for s in range(-reach, reach + 1):
            low, high = max(0, -s), min(width, width - s)
            _add(out[k, row, low:high], images[k, row, low + s : high + s], kernel[s + reach])


@njit(cache=True, nogil=True)
def along_columns(worker, workers, images, kernel, out):
    """`along_rows`, for columns."""
    views, height, _ = images.shape
    reach = len(kernel) // 2
    for job in range(worker, views * height, workers):
        k, row = job // height, job % height
        for s in range(max(-reach, -row), min(reach + 1, height - row)):
            _add(out[k, row], images[k, row + s], kernel[s + reach])
