"""What pictures allow: the silhouettes of their visual hull are the ceiling of any sculpture's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..exact.visual_hull import visual_hull
from ..geometry.cameras import Camera
from ..geometry.silhouette_edges import Views
from ..silhouettes import likeness, render_at_rest
from ..util.errors import InputError

AGREEING_LIKENESS = 0.95  # intersection over union with the ceiling under which pictures are said to disagree


def hull_silhouettes(pictures: np.ndarray, cameras: Sequence[Camera]) -> np.ndarray:
    """`(K, H, H)` bool: the silhouettes of the visual hull of `pictures` `(K, H, H)` bool. Raises InputError as
    `visual_hull` does, and for fewer than two views or more than four."""
    if not 2 <= len(pictures) <= 4:
        raise InputError(f"art has two to four views, got {len(pictures)}")
    hull = visual_hull(np.asarray(pictures, float), cameras)
    return render_at_rest(hull, Views(cameras), pictures.shape[-1]).numpy() > 0.5


def disagreements(pictures: np.ndarray, hull: np.ndarray, cameras: Sequence[Camera]) -> list[str]:
    """A line for each picture that its ceiling falls short of, with the rows that another leaves empty.

    pictures, hull `(K, H, H)` bool: the pictures, and their `hull_silhouettes`.
    """
    lines = []
    for k, best in enumerate(likeness(hull, pictures)):
        if best >= AGREEING_LIKENESS:
            continue
        line = f"the picture {cameras[k].direction} can be met to {best:.1%} at most"
        for other, picture in enumerate(pictures):
            level = cameras[k].elevation_deg == cameras[other].elevation_deg == 0
            rows = np.flatnonzero(pictures[k].any(1) & ~picture.any(1)) if level else []
            if len(rows):
                line += f"; {len(rows)} of its rows are empty in the one {cameras[other].direction}"
        lines.append(f"{line}; choose pictures that agree better")
    return lines
