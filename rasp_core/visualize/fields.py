"""Slices through signed distance fields: inside and outside, outlines, and the query points that two objects share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import torch

from ..geometry.meshes import Body
from ..geometry.sdf import GridStack
from ..poses import Poses
from . import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = "PRGn"  # purple inside, green outside; orange, blue and red have a meaning of their own
LEVELS = 8  # lines of equal distance from the largest depth to the surface


def across(bodies: Sequence[Body], poses: Poses, low: Sequence[float], high: Sequence[float], y: float, columns: int):
    """Signed distances `(N, H, columns)` in metres, negative inside, of posed bodies on the plane at `y`.

    low, high : x and z of the slice's corners. Row 0 is on top. Beyond a body's own grid it is the distance there.
    """
    rows = max(round(columns * (high[1] - low[1]) / (high[0] - low[0])), 1)
    x, z = np.linspace(low[0], high[0], columns), np.linspace(high[1], low[1], rows)
    x, z = np.meshgrid(x, z)
    world = torch.from_numpy(np.stack([x, np.full_like(x, y), z], -1).reshape(-1, 3)).float()
    stack, found = GridStack.of_bodies(list(bodies)), []
    for k in range(len(bodies)):
        local = (world - poses.translation[k].float().cpu()) @ poses.rotation[k].float().cpu()
        found.append(stack.sample(torch.full((len(local),), k), local)[0].reshape(rows, columns).numpy())
    return np.stack(found)


def shaded(field: np.ndarray) -> np.ndarray:
    """A field `(H, W)` as RGB `(H, W, 3)`: purple inside, green outside, darker the farther from the surface."""
    import matplotlib

    wide = np.abs(field).max()
    return matplotlib.colormaps[COLOURS](0.5 + 0.4 * field / wide)[..., :3]


def draw_lines(axis: Axes, field: np.ndarray) -> None:
    """Lines of equal distance over `shaded`, the surface thick."""
    deepest = float(-field.min())
    if deepest <= 0:
        return
    axis.contour(field, np.arange(-LEVELS, 2 * LEVELS) * deepest / LEVELS, colors="k", linewidths=0.6, alpha=0.5)
    axis.contour(field, [0], colors="k", linewidths=2.5)


def draw_points(axis: Axes, fields: np.ndarray, step: int = 6) -> tuple[int, int]:
    """Query points every `step` pixels of fields `(N, H, W)`: black in one object, red in two or more, faint in none.

    Returns how many lie in one, and in two or more.
    """
    rows, columns = (np.arange(step // 2, size, step) for size in fields.shape[1:])
    columns, rows = np.meshgrid(columns, rows)
    inside = (fields[:, rows, columns] < 0).sum(0)
    looks = ((inside == 0, "0.8", 3), (inside == 1, "k", 8), (inside >= 2, style.OVERLAP, 26))
    for where, colour, size in looks:
        axis.scatter(columns[where], rows[where], s=size, color=[colour], linewidths=0)
    for field in fields:
        axis.contour(field, [0], colors="k", linewidths=2)
    return int((inside == 1).sum()), int((inside >= 2).sum())
