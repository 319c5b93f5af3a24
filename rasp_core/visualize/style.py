"""How every figure looks: one font, one size of text, one meaning per colour; and how small its text has become."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 150  # of the figures' PNGs
SHOWN_DPI = 72  # of what notebooks show in between
WIDE = 13.0  # inches, of a figure that fills a page
LEGIBLE_PX = 12.0  # of a letter's height, its line, with the figure at a third of its size
TEXT_PT = math.ceil(2 * LEGIBLE_PX * 3 * 72 / DPI) / 2  # the smallest text that is legible there

# One colour, one meaning, RGB in [0, 1]: what a shadow lacks, what it has too much, what two objects share, the walls.
MISSING, TOO_MUCH, OVERLAP, WALLS = (1.0, 0.5, 0.0), (0.0, 0.5, 1.0), (0.84, 0.1, 0.1), (0.5, 0.5, 0.5)
# The curves of L_sil, L_is and L_ext: of what is missing first, of what is shared, of the walls.
LOSSES = (MISSING, OVERLAP, WALLS)
# Methods, containers and whatever else has to differ, in colours that mean nothing.
OTHERS = ("#1b7f79", "#7a5195", "#b8860b", "#4d4d4d", "#6a9a1f", "#d45087", "#8c564b")

RC: Mapping[str, object] = {
    "font.family": "DejaVu Sans",  # comes with matplotlib, so that it is the same everywhere
    "font.size": TEXT_PT,
    **dict.fromkeys(("axes.titlesize", "axes.labelsize", "xtick.labelsize", "ytick.labelsize"), TEXT_PT),
    **dict.fromkeys(("legend.fontsize", "figure.titlesize", "legend.title_fontsize"), TEXT_PT),
    "axes.titlepad": 6.0,
    "axes.labelpad": 4.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": False,
    "grid.alpha": 0.3,
    "lines.linewidth": 2.5,
    "lines.markersize": 8.0,
    "legend.frameon": False,
    "legend.handlelength": 1.2,
    "figure.constrained_layout.w_pad": 0.06,
    "figure.constrained_layout.h_pad": 0.06,
    "savefig.pad_inches": 0.06,
}


def use() -> None:
    """Have all figures of this process look so."""
    import matplotlib
    from cycler import cycler

    matplotlib.rcParams.update({**RC, "axes.prop_cycle": cycler(color=OTHERS)})


def difference(image: np.ndarray, target: np.ndarray) -> np.ndarray:
    """A shadow over what it should be, RGB in [0, 1] of shape `(..., 3)`: black as wanted, orange missing, blue too
    much, white neither. image, target : of one shape, in [0, 1]."""
    image, target = np.asarray(image, float), np.asarray(target, float)
    return np.stack([1 - image, 1 - (image + target) / 2, 1 - target], -1).clip(0, 1)


def smallest_text(figure: Figure) -> float:
    """The size in points of the smallest text that a drawing of the figure has; infinite where it has none."""
    from matplotlib.backends.backend_agg import RendererAgg

    sizes = [math.inf]

    class Listening(RendererAgg):
        def draw_text(self, gc, x, y, s, prop, *rest, **more):
            if str(s).strip():
                sizes.append(prop.get_size_in_points())

        def draw_image(self, *_, **__):
            """Pictures have no text that matplotlib knows of."""

    figure.draw(Listening(figure.bbox.width, figure.bbox.height, figure.dpi))
    return min(sizes)


def pixels_at_a_third(figure: Figure) -> float:
    """How high the smallest text's line is, in pixels, with the figure at a third of its size as `DPI` has it."""
    return smallest_text(figure) / 72 * DPI / 3
