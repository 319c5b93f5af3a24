"""Silhouettes from picture files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .errors import InputError

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


def _read(path: Path) -> np.ndarray:
    from PIL import Image, UnidentifiedImageError

    if not path.is_file():
        raise InputError(f"{path}: no such picture")
    try:
        with Image.open(path) as picture:
            picture.load()
            values = np.asarray(picture.convert("RGBA"), np.float32) / 255
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise InputError(f"{path}: cannot be read as a picture; use PNG or JPEG") from error
    share = values[..., 3]
    if np.ptp(share) < CONTRAST:
        grey = values[..., :3].mean(-1)
        border = np.concatenate([grey[0], grey[-1], grey[:, 0], grey[:, -1]])
        share = np.abs(grey - np.median(border))
        if share.max() < CONTRAST:
            raise InputError(f"{path}: shows one brightness only; a silhouette differs from its background")
        share = share / share.max()
    return share
