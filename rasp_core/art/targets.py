"""What sculptures are to show, from picture files or from words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..io.images import read_targets
from ..util.errors import InputError
from .glyphs import letters

LEAST_RESOLUTION = 32


@dataclass(frozen=True)
class Targets:
    """The pictures of one sculpture, row 0 on top.

    pictures `(K, H, H)` bool: what should be dark. colours `(K, H, H, 3)` float32 in [0, 1]; None for letters.
    """

    pictures: np.ndarray
    colours: np.ndarray | None = None


def from_files(paths: Sequence[str | Path], resolution: int = 512) -> Targets:
    """The pictures of these files, `resolution` pixels along each. Raises InputError as `read_targets` does, and for
    fewer than 32 pixels."""
    _check(resolution)
    pictures, colours = read_targets(paths, resolution)
    return Targets(pictures, colours)


def from_text(words: Sequence[str], resolution: int = 512, square: bool = False) -> list[Targets]:
    """For each place in the longest words what is there: "CVPR", "2025" gives four sculptures, of C and 2 to R and 5;
    of a shorter word parts of letters, as `letters` has it.

    square : as wide as high, for views from above. Raises InputError as `letters` does, and for fewer than 32 pixels.
    """
    _check(resolution)
    return [Targets(pictures) for pictures in letters(words, resolution, square)]


def _check(resolution: int) -> None:
    if resolution < LEAST_RESOLUTION:
        raise InputError(f"a picture's resolution must be at least {LEAST_RESOLUTION}, got {resolution}")
