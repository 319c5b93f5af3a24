"""Pictures to be shown by heaps: drawn shapes, and public-domain portraits that come with scikit-image."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

PORTRAITS = {"astronaut": (0, 60, 330), "chelsea": (0, 100, 300)}  # top, left and edge of a square, in pixels


def shapes(size: int) -> dict[str, np.ndarray]:
    """A heart, a star and a moon, each `(size, size)` bool, row 0 on top, of four fifths of the picture's height."""
    steps = 2 * ((np.arange(size) + 0.5) / size - 0.5) / 0.8
    x, y = steps[None], -steps[:, None]
    outlines: dict[str, Callable] = {"heart": _heart, "star": _star, "moon": _moon}
    return {name: np.asarray(inside(x, y)) for name, inside in outlines.items()}


def portraits(size: int) -> np.ndarray:
    """Eileen Collins (NASA, public domain) and the cat Chelsea (Stefan van der Walt, CC0), in oval frames: `(2, size,
    size, 4)` uint8, RGBA, row 0 on top."""
    from PIL import Image
    from skimage import data

    steps = 2 * ((np.arange(size) + 0.5) / size - 0.5)
    oval = 255 * ((steps[None] / 0.66) ** 2 + (steps[:, None] / 0.84) ** 2 < 1).astype(np.uint8)
    found = []
    for name, (top, left, edge) in PORTRAITS.items():
        picture = getattr(data, name)()[top : top + edge, left : left + edge]
        colours = np.asarray(Image.fromarray(picture).resize((size, size), Image.Resampling.LANCZOS))
        found.append(np.dstack([colours, oval]))
    return np.stack(found)


def _heart(x, y):
    """The curve (x^2 + y^2 - 1)^3 = x^2 y^3, which spans -1 to 1.24 in height."""
    x, y = 1.12 * x, 1.12 * y + 0.12
    return (x**2 + y**2 - 1) ** 3 < x**2 * y**3


def _star(x, y):
    """Five points, one up: what lies within at least four of the five lines that join every second point."""
    turns = np.pi / 2 + 2 * np.pi * np.arange(5) / 5
    x, y = 0.905 * x, 0.905 * y + 0.095  # from its lowest points to its highest
    inner = np.cos(2 * np.pi / 5)
    sides = sum((x * np.cos(t) + y * np.sin(t) <= inner).astype(int) for t in turns)
    return sides >= 4


def _moon(x, y):
    return (x**2 + y**2 < 1) & ((x - 0.55) ** 2 + y**2 > 0.75**2)
