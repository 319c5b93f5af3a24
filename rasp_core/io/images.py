"""Silhouettes and colours from picture files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..util.errors import InputError

PAPER = 250  # of 255: what is brighter is paper, where the border is
EVEN = 0.9  # share of the border that a background colours alike
CONTRAST = 0.1  # of the brightest: the least difference from the background that a picture must hold


def read_silhouettes(paths: Sequence[str | Path]) -> np.ndarray:
    """Silhouettes `(K, H, H)` float32 in [0, 1], 1 where the thing is, row 0 on top.

    A picture's alpha says where the thing is; where it has none, what differs from the border's brightness by more than
    half of the largest difference. Raises InputError for files that are no pictures, are not square or of different
    sizes, or show one brightness only.
    """
    images = [_read(Path(path)) for path in paths]
    for path, image in zip(paths, images, strict=True):
        if image.shape != images[0].shape or image.shape[0] != image.shape[1]:
            sizes = ", ".join(f"{p}: {i.shape[1]} x {i.shape[0]}" for p, i in zip(paths, images, strict=True))
            raise InputError(f"silhouettes must be square and of one size, got {sizes}; mend {path}")
    return np.stack(images)


def read_targets(paths: Sequence[str | Path], size: int) -> tuple[np.ndarray, np.ndarray]:
    """Pictures to be shown: what should be dark `(K, size, size)` bool, and colours `(K, size, size, 3)` float32 in
    [0, 1] on white, row 0 on top.

    A picture is stretched to a square. What should be dark is what its alpha covers; on white paper, what is darker
    than `PAPER`; on another even background, what differs from it by half of the largest difference; else all of it.
    Raises InputError for files that are no pictures, or of which nothing is dark.
    """
    from PIL import Image

    darks, colours = [], []
    for path in paths:
        picture = _open(Path(path))
        alpha = np.asarray(picture.getchannel("A").resize((size, size)))
        paper = Image.new("RGBA", picture.size, "white")
        colour = Image.alpha_composite(paper, picture).convert("RGB")
        grey = np.asarray(colour.convert("L").resize((size, size)))
        dark = alpha > 127 if np.ptp(alpha) else _off_background(grey)
        if not dark.any():
            raise InputError(f"{path}: is blank; a target differs from its background")
        darks.append(dark)
        colours.append(np.asarray(colour.resize((size, size)), np.float32) / 255)
    return np.stack(darks), np.stack(colours)


def _off_background(grey: np.ndarray) -> np.ndarray:
    """What is dark of an image `(H, H)` uint8, by its border."""
    border = np.concatenate([grey[0], grey[-1], grey[:, 0], grey[:, -1]]).astype(int)
    if (border > PAPER).mean() > 0.5:
        return grey <= PAPER
    behind = np.median(border)
    apart = np.abs(grey - behind)
    if (np.abs(border - behind) < 255 * CONTRAST).mean() < EVEN:
        return np.ones_like(grey, bool)
    return apart > max(apart.max() / 2, 255 * CONTRAST)


def _open(path: Path):
    """The picture in RGBA, loaded."""
    from PIL import Image, UnidentifiedImageError

    if not path.is_file():
        raise InputError(f"{path}: no such picture")
    try:
        with Image.open(path) as picture:
            return picture.convert("RGBA")
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise InputError(f"{path}: cannot be read as a picture; use PNG or JPEG") from error


def _read(path: Path) -> np.ndarray:
    values = np.asarray(_open(path), np.float32) / 255
    coverage = values[..., 3]
    if np.ptp(coverage) < CONTRAST:
        grey = values[..., :3].mean(-1)
        border = np.concatenate([grey[0], grey[-1], grey[:, 0], grey[:, -1]])
        coverage = np.abs(grey - np.median(border))
        if coverage.max() < CONTRAST:
            raise InputError(f"{path}: shows one brightness only; a silhouette differs from its background")
        coverage = coverage / coverage.max()
    return coverage
