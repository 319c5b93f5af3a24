"""Pictures in few colours: PNGs and films that are small and look as they did."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

SAMPLE = 50_000  # pixels from which a palette is chosen
SPREAD = 6.0  # of 255: how far the pattern that breaks bands up moves a pixel's colour
ORDER = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]])  # a 4 x 4 threshold matrix


def png(pixels: np.ndarray, large: float = np.inf) -> bytes:
    """A PNG of `pixels` `(H, W, 3)` uint8 in 256 colours: a third of its size in all colours. White stays white.

    large : bytes, above which it is in 128 colours.
    """
    found = _png(pixels, 256)
    return found if len(found) <= large else _png(pixels, 128)


def _png(pixels: np.ndarray, colours: int) -> bytes:
    data = io.BytesIO()
    _indexed(pixels, _chosen(pixels, colours), SPREAD).save(data, "PNG", optimize=True)
    return data.getvalue()


def save_gif(path: str | Path, pictures: Sequence[np.ndarray], seconds: float = 4.0, colours: int = 64) -> None:
    """Pictures `(H, W, 3)` uint8, all of one size, as an endless film of `seconds`, in the same `colours`."""
    palette = _chosen(np.stack(pictures), colours)
    first, *rest = (_indexed(picture, palette) for picture in pictures)
    duration = round(1000 * seconds / len(pictures))
    first.save(path, "GIF", save_all=True, append_images=rest, duration=duration, loop=0, optimize=True)


def _chosen(pixels: np.ndarray, colours: int) -> np.ndarray:
    """`(C, 3)` uint8, white first, then those that come nearest to the pixels that are not white."""
    from PIL import Image

    white, flat = np.full((1, 3), 255, np.uint8), pixels.reshape(-1, 3)
    ink = flat[(flat < 255).any(1)]
    if not len(ink):
        return white
    # evenly spread, and no multiple of a picture's width, which would take single columns
    ink = ink[np.linspace(0, len(ink) - 1, min(len(ink), SAMPLE)).astype(int)]
    found = Image.fromarray(ink[None]).quantize(colours - 1, Image.Quantize.MEDIANCUT, kmeans=1, dither=0)
    return np.vstack([white, np.reshape(found.getpalette(), (-1, 3))[: colours - 1].astype(np.uint8)])


def _indexed(pixels: np.ndarray, palette: np.ndarray, spread: float = 0.0):
    """The picture in the palette's colours, each pixel in the nearest; Pillow's own search misses it by some shades."""
    from PIL import Image
    from scipy.spatial import cKDTree

    rows, columns = pixels.shape[:2]
    index, ink = np.zeros((rows, columns), np.uint8), (pixels < 255).any(2)
    pattern = np.tile((ORDER / 15 - 0.5) * spread, (rows // 4 + 1, columns // 4 + 1))[:rows, :columns, None]
    index[ink] = cKDTree(palette).query((pixels + pattern)[ink])[1]
    picture = Image.fromarray(index, "P")
    picture.putpalette(palette.ravel().tolist())
    return picture
