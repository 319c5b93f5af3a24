"""Sheets of pictures in rows that fill the page, with a title above each, and room for plots among them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from . import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LINE = style.TEXT_PT / 72 * 1.25  # inches, of a line of text
GAP = 0.12  # inches, between neighbours
ABOVE = 0.06  # inches, between a picture and its title
PLOT = (1.05, 0.12, 0.95, 0.1)  # inches left, right, below and above a plot's axes, for its ticks and labels

Cell = tuple[str, "np.ndarray | float"]


def sheet(rows: Sequence[Sequence[Cell]], labels: Sequence[str] = (), wide: float = style.WIDE) -> tuple[Figure, list]:
    """A figure `wide` inches wide, and its axes row by row.

    rows : of pairs, a title (of one line or more, or none) and a picture `(H, W, 3)` or `(H, W)` in grey, black 0; or,
    for a plot to be drawn by the caller, how many times wider than high it is. All in a row are of one height, so that
    the row is full. labels : of the rows, written along their left edge.
    """
    from matplotlib.figure import Figure

    left = 1.2 * LINE if any(labels) else 0.0
    inner, plans, high = wide - left, [], 0.0
    for row in rows:
        shapes = [cell if np.isscalar(cell) else cell.shape[1] / cell.shape[0] for _, cell in row]
        tall = (inner - GAP * (len(row) - 1)) / sum(shapes)
        lines = max(len(title.splitlines()) for title, _ in row)
        head = ABOVE + lines * LINE if lines else 0.0
        plans.append((shapes, tall, head))
        high += tall + head + GAP
    high -= GAP
    figure, found, top = Figure(figsize=(wide, high)), [], high
    for (shapes, tall, head), row, label in zip(plans, rows, [*labels, *[""] * len(rows)], strict=False):
        top -= tall + head
        x, made = left, []
        for shape, (title, cell) in zip(shapes, row, strict=True):
            place = (x, top, shape * tall, tall)
            axis = _plot(figure, place) if np.isscalar(cell) else draw(figure, place, cell)
            figure.text((x + shape * tall / 2) / wide, (top + tall + ABOVE) / high, title, ha="center", va="bottom")
            made.append(axis)
            x += shape * tall + GAP
        if label:
            figure.text(0.1 * LINE / wide, (top + tall / 2) / high, label, rotation=90, ha="left", va="center")
        found.append(made)
        top -= GAP
    return figure, found


def draw(figure: Figure, place: Sequence[float], pixels: np.ndarray) -> Axes:
    """A picture's axes, without ticks: `place` is left and bottom edge, width and height, in inches; pixels as in
    `sheet`."""
    axis = figure.add_axes(_share(figure, place))
    axis.imshow(pixels, aspect="auto", cmap="gray", vmin=0, vmax=1, interpolation="antialiased")
    axis.set_axis_off()
    return axis


def _plot(figure: Figure, place: Sequence[float]) -> Axes:
    x, y, wide, high = place
    left, right, below, above = PLOT
    return figure.add_axes(_share(figure, (x + left, y + below, wide - left - right, high - below - above)))


def _share(figure: Figure, place: Sequence[float]) -> list[float]:
    wide, high = figure.get_size_inches()
    return [place[0] / wide, place[1] / high, place[2] / wide, place[3] / high]
