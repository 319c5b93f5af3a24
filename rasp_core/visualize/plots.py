"""Plots, by matplotlib: silhouettes beside their targets, and losses over the iterations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..geometry.cameras import Camera
from ..objective import LOSS_NAMES
from ..optimizer import Arrangement

if TYPE_CHECKING:
    from matplotlib.figure import Figure, FigureBase

ROW_INCHES = 2.4  # height of a row of silhouettes, and width of a view
CURVES = (1, 2, 3)  # columns of the history that are drawn: Eq. 2, 4 and 5


def silhouette_figure(targets: np.ndarray, images: np.ndarray, cameras: Sequence[Camera]) -> Figure:
    """Target, rendered and difference for each view; targets, images `(K, H, W)` in [0, 1], row 0 on top."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(ROW_INCHES * len(cameras), 3 * ROW_INCHES), layout="constrained")
    _draw_silhouettes(figure, targets, images, cameras)
    return figure


def loss_figure(arrangement: Arrangement) -> Figure:
    """The loss terms over the iterations."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 3.2), layout="constrained")
    _draw_losses(figure, arrangement.history)
    return figure


def overview_figure(arrangement: Arrangement, history: np.ndarray | None = None) -> Figure:
    """Silhouettes as `silhouette_figure` has them, and the loss terms below if there were iterations.

    history : `(I, 5)` losses, the arrangement's own if None.
    """
    from matplotlib.figure import Figure

    history = arrangement.history if history is None else history
    wide, high = max(7.0, ROW_INCHES * len(arrangement.cameras)), 3 * ROW_INCHES
    if not len(history):
        figure = Figure(figsize=(wide, high), layout="constrained")
        _draw_silhouettes(figure, arrangement.targets, arrangement.images, arrangement.cameras)
        return figure
    figure = Figure(figsize=(wide, high + 3), layout="constrained")
    above, below = figure.subfigures(2, 1, height_ratios=[high, 3])
    _draw_silhouettes(above, arrangement.targets, arrangement.images, arrangement.cameras)
    _draw_losses(below, history)
    return figure


def _draw_silhouettes(figure: FigureBase, targets: np.ndarray, images: np.ndarray, cameras: Sequence[Camera]) -> None:
    axes = figure.subplots(3, len(cameras), squeeze=False)
    for k, camera in enumerate(cameras):
        axes[0, k].imshow(targets[k], cmap="gray_r", vmin=0, vmax=1)
        axes[1, k].imshow(images[k], cmap="gray_r", vmin=0, vmax=1)
        axes[2, k].imshow(images[k] - targets[k], cmap="RdBu_r", vmin=-1, vmax=1)
        axes[0, k].set_title(f"azimuth {camera.azimuth_deg:.0f}°\nelevation {camera.elevation_deg:.0f}°", fontsize=10)
    for row, name in zip(axes, ("target", "rendered", "rendered − target"), strict=True):
        row[0].set_ylabel(name)
    for axis in axes.flat:
        axis.set(xticks=[], yticks=[])


def _draw_losses(figure: FigureBase, history: np.ndarray) -> None:
    axes = figure.subplots(1, len(CURVES))
    for axis, column in zip(axes, CURVES, strict=True):
        axis.plot(history[:, column], color=f"C{column - 1}")
        axis.set(title=LOSS_NAMES[column], xlabel="iteration")
        axis.grid(alpha=0.3)
    axes[1].set_yscale("symlog", linthresh=1e-3)
