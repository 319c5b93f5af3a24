"""The method as a diagram, with the kit's own pictures in its boxes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from . import sheets, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK, PAPER = "#3a4a5a", "#f4f6f8"
# name, title, left and bottom edge, width and height, in inches
BOXES = (
    ("objects", "objects", 0.1, 2.3, 2.3, 2.5),
    ("poses", "poses: turn, shift", 3.0, 2.3, 2.5, 2.5),
    ("shadows", "renderer: shadows", 6.1, 3.9, 2.9, 2.6),
    ("fields", "signed distances", 6.1, 0.6, 2.9, 2.6),
)
LOSSES = (
    (r"$\mathcal{L}_{sil}$: shadows", 4.75, style.LOSSES[0]),
    (r"$\mathcal{L}_{is}$: overlap", 2.35, style.LOSSES[1]),
    (r"$\lambda\,\mathcal{L}_{ext}$: walls", 1.05, style.LOSSES[2]),
)
LOSS_BOX = (9.5, 3.05, 0.95)  # left edge, width, height
HIGH = 7.2


def pipeline(pictures: Mapping[str, Sequence[np.ndarray]]) -> Figure:
    """Objects, poses, renderer and signed distances, three losses, and Adam, which changes the poses.

    pictures : for "objects", "poses", "shadows" and "fields", RGB or grey pictures that are drawn in that box, side by
    side.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(style.WIDE, HIGH))
    axis = figure.add_axes((0, 0, 1, 1), xlim=(0, style.WIDE), ylim=(0, HIGH))
    axis.set_axis_off()
    for name, title, x, y, wide, high in BOXES:
        _box(axis, x, y, wide, high, INK)
        axis.text(x + wide / 2, y + high - 0.24, title, ha="center", va="center")
        _fill(figure, pictures[name], x + 0.12, y + 0.1, wide - 0.24, high - 0.6)
    left, wide, high = LOSS_BOX
    for title, y, colour in LOSSES:
        _box(axis, left, y, wide, high, colour)
        axis.text(left + wide / 2, y + high / 2, title, ha="center", va="center")
    _arrow(axis, (2.4, 3.55), (3.0, 3.55))
    _arrow(axis, (5.5, 4.0), (6.1, 4.9))
    _arrow(axis, (5.5, 3.1), (6.1, 2.2))
    _arrow(axis, (9.0, 5.2), (left, 5.2))
    for y in (2.8, 1.5):
        _arrow(axis, (9.0, 1.95), (left, y))
    _box(axis, 3.0, 6.2, 2.5, 0.85, INK)
    axis.text(4.25, 6.62, "Adam", ha="center", va="center")
    turn = left + wide + 0.25
    for _, y, colour in LOSSES:
        axis.plot([left + wide, turn], [y + high / 2] * 2, color=colour, lw=3)
    axis.plot([turn] * 2, [LOSSES[-1][1] + high / 2, 6.85], color=INK, lw=3)
    _arrow(axis, (turn, 6.85), (5.5, 6.85))
    axis.text(10.6, 6.85, "gradient", ha="center", va="center", backgroundcolor="white")
    _arrow(axis, (4.25, 6.2), (4.25, 4.8))
    return figure


def _box(axis, x: float, y: float, wide: float, high: float, colour) -> None:
    from matplotlib.patches import FancyBboxPatch

    rounded = "round,pad=0,rounding_size=0.12"
    axis.add_patch(FancyBboxPatch((x, y), wide, high, boxstyle=rounded, facecolor=PAPER, edgecolor=colour, linewidth=3))


def _arrow(axis, start, end) -> None:
    head = "-|>,head_width=0.45,head_length=0.7"
    look = {"arrowstyle": head, "linewidth": 3, "color": INK, "shrinkA": 0, "shrinkB": 0}
    axis.annotate("", end, start, arrowprops=look)


def _fill(figure: Figure, pictures: Sequence[np.ndarray], x: float, y: float, wide: float, high: float) -> None:
    """Pictures side by side in the middle of a rectangle, in inches, as large as they fit."""
    shapes = [picture.shape[1] / picture.shape[0] for picture in pictures]
    gap = 0.08
    tall = min(high, (wide - gap * (len(shapes) - 1)) / sum(shapes))
    x += (wide - tall * sum(shapes) - gap * (len(shapes) - 1)) / 2
    for picture, shape in zip(pictures, shapes, strict=True):
        sheets.draw(figure, (x, y + (high - tall) / 2, shape * tall, tall), picture)
        x += shape * tall + gap
