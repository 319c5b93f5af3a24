"""Plots, by matplotlib: silhouettes beside their targets, and losses over the iterations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..geometry.cameras import Camera
from ..objective import LOSS_NAMES
from ..optimizer import Arrangement
from . import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure, FigureBase

ROW_INCHES = 3.0  # height of a row of silhouettes, and width of a view
LOSS_INCHES = 3.6  # height of a row of curves
CURVES = (1, 2, 3)  # columns of the history that are drawn: Eq. 2, 4 and 5


def silhouette_figure(targets: np.ndarray, images: np.ndarray, cameras: Sequence[Camera]) -> Figure:
    """Target, rendered and difference for each view; targets, images `(K, H, W)` in [0, 1], row 0 on top."""
    with _styled():
        figure = _new(max(2, len(cameras)) * ROW_INCHES, 3 * ROW_INCHES)
        _draw_silhouettes(figure, targets, images, cameras)
    return figure


def loss_figure(arrangement: Arrangement) -> Figure:
    """The loss terms over the iterations."""
    with _styled():
        figure = _new(style.WIDE, LOSS_INCHES)
        _draw_losses(figure, arrangement.history)
    return figure


def overview_figure(arrangement: Arrangement, history: np.ndarray | None = None) -> Figure:
    """Silhouettes as `silhouette_figure` has them, and the loss terms below if there were iterations.

    history : `(I, 5)` losses, the arrangement's own if None.
    """
    history = arrangement.history if history is None else history
    wide, high = max(style.WIDE, ROW_INCHES * len(arrangement.cameras)), 3 * ROW_INCHES
    with _styled():
        figure = _new(wide, high + (LOSS_INCHES if len(history) else 0))
        parts = figure.subfigures(2, 1, height_ratios=[high, LOSS_INCHES]) if len(history) else [figure]
        _draw_silhouettes(parts[0], arrangement.targets, arrangement.images, arrangement.cameras)
        if len(history):
            _draw_losses(parts[1], history)
    return figure


def _styled():
    import matplotlib

    return matplotlib.rc_context(dict(style.RC))


def _new(wide: float, high: float) -> Figure:
    from matplotlib.figure import Figure

    return Figure(figsize=(wide, high), layout="constrained")


def _draw_silhouettes(figure: FigureBase, targets: np.ndarray, images: np.ndarray, cameras: Sequence[Camera]) -> None:
    axes = figure.subplots(3, len(cameras), squeeze=False)
    for k, camera in enumerate(cameras):
        axes[0, k].imshow(targets[k], cmap="gray_r", vmin=0, vmax=1)
        axes[1, k].imshow(images[k], cmap="gray_r", vmin=0, vmax=1)
        axes[2, k].imshow(style.difference(images[k], targets[k]))
        axes[0, k].set_title(f"azimuth {camera.azimuth_deg:.0f}°\nelevation {camera.elevation_deg:.0f}°")
    for row, name in zip(axes, ("target", "rendered", "orange: missing\nblue: too much"), strict=True):
        row[0].set_ylabel(name)
    for axis in axes.flat:
        axis.set(xticks=[], yticks=[])


def _draw_losses(figure: FigureBase, history: np.ndarray) -> None:
    axes = figure.subplots(1, len(CURVES))
    for axis, column, colour in zip(axes, CURVES, style.LOSSES, strict=True):
        axis.plot(history[:, column], color=colour)
        axis.set(title=LOSS_NAMES[column], xlabel="iteration")
        axis.locator_params(nbins=4)
        axis.grid(alpha=0.3)
    axes[1].set_yscale("symlog", linthresh=1e-3)
