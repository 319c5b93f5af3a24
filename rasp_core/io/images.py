"""Silhouettes and colours from picture files."""

from __future__ import annotations

import re
import struct
import warnings
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..util.errors import InputError, PictureWarning
from .ink import Ink, find_ink

HEAD = 4096  # bytes that tell what a file is
DEPTHS = (8, 10, 12, 14, 16)  # bits of grey
LARGEST = 1024  # pixels along a picture that is looked at
KEPT = 0.5  # of the ink must be left at the size asked for
AGAIN = "copy or save it again"


def read_silhouettes(paths: Sequence[str | Path]) -> np.ndarray:
    """Silhouettes `(K, H, H)` float32 in [0, 1], 1 where the thing is, row 0 on top.

    What is the thing is decided by `ink.find_ink`; what was guessed is a PictureWarning. Raises InputError for files
    that are no pictures, are not square or of different sizes, or in which nothing can be told from its ground.
    """
    images = []
    for path in paths:
        colour, alpha = _layers(_open(Path(path)))
        images.append(_find(path, colour, alpha).coverage)
    for path, image in zip(paths, images, strict=True):
        if image.shape != images[0].shape or image.shape[0] != image.shape[1]:
            sizes = ", ".join(f"{p}: {i.shape[1]} x {i.shape[0]}" for p, i in zip(paths, images, strict=True))
            raise InputError(f"silhouettes must be square and of one size, got {sizes}; mend {path}")
    return np.stack(images)


def read_targets(paths: Sequence[str | Path], size: int) -> tuple[np.ndarray, np.ndarray]:
    """Pictures to be shown: what should be dark `(K, size, size)` bool, and colours `(K, size, size, 3)` float32 in
    [0, 1] on white, row 0 on top.

    A picture that is not square is set in the middle of a square of its ground. What should be dark is decided by
    `ink.find_ink`; what was guessed is a PictureWarning. Raises InputError for files that are no pictures, or in which
    nothing can be told from its ground or is left at this size.
    """
    darks, colours = [], []
    for path in paths:
        picture = _open(Path(path))
        largest = max(LARGEST, 2 * size)
        if max(picture.size) > largest:
            # In premultiplied colours, or the colours of clear pixels would show.
            shape = [max(1, round(n * largest / max(picture.size))) for n in picture.size]
            picture = picture.convert("RGBa").resize(shape).convert("RGBA")
        colour, alpha = _layers(picture)
        ink = _find(path, colour, alpha)
        dark = _square(ink.coverage, 0, size) > 0.5
        whole = (ink.coverage > 0.5).sum() / max(ink.coverage.shape) ** 2
        if dark.mean() <= KEPT * whole:
            raise InputError(f"{path}: its lines are too thin to show in {size} x {size} pixels; draw them thicker")
        darks.append(dark)
        colours.append(np.stack([_square(colour[..., k], ink.ground[k], size) for k in range(3)], -1))
    return np.stack(darks), np.clip(np.stack(colours), 0, 1)


def _find(path: str | Path, colour: np.ndarray, alpha: np.ndarray) -> Ink:
    try:
        ink = find_ink(colour, alpha)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    for guess in ink.guesses:
        warnings.warn(f"{path}: {guess}", PictureWarning, stacklevel=3)
    return ink


def _layers(picture) -> tuple[np.ndarray, np.ndarray]:
    """Colours on white `(H, W, 3)` and alpha `(H, W)` of a picture in RGBA, float32 in [0, 1]."""
    values = np.asarray(picture, np.float32) / 255
    alpha = values[..., 3]
    # A sheet of one alpha all over is read as if it were opaque.
    over = alpha[..., None] if np.ptp(alpha) else np.ones((1, 1, 1), np.float32)
    return values[..., :3] * over + (1 - over), alpha


def _square(image: np.ndarray, around: float, size: int) -> np.ndarray:
    """An image `(H, W)` in the middle of a square, `(size, size)` float32."""
    from PIL import Image

    side = max(image.shape)
    whole = np.full((side, side), around, np.float32)
    top, left = ((side - n) // 2 for n in image.shape)
    whole[top : top + image.shape[0], left : left + image.shape[1]] = image
    return np.asarray(Image.fromarray(whole).resize((size, size)))


def _open(path: Path):
    """The first picture in the file, upright, in RGBA, loaded. Raises InputError with the reason if there is none."""
    from PIL import Image, ImageOps, UnidentifiedImageError

    if not path.is_file():
        raise InputError(f"{path}: no such picture")
    with path.open("rb") as file:
        head = file.read(HEAD)
    if reason := _no_pixels(path, head):
        raise InputError(f"{path}: {reason}")
    try:
        with Image.open(path) as picture:
            # A phone's MPO holds previews beside its picture.
            if picture.format != "MPO" and getattr(picture, "n_frames", 1) > 1:
                warnings.warn(f"{path}: holds several pictures; the first is taken", PictureWarning, stacklevel=3)
            picture.load()
            return _rgba(ImageOps.exif_transpose(picture))
    except Image.DecompressionBombError as error:
        raise InputError(f"{path}: has too many pixels; make it smaller") from error
    except UnidentifiedImageError as error:
        raise InputError(f"{path}: {_unread(head)}") from error
    except (OSError, EOFError, ValueError, SyntaxError, struct.error, zlib.error, IndexError) as error:
        riff = head.startswith(b"RIFF") and path.stat().st_size < int.from_bytes(head[4:8], "little") + 8
        cut = riff or isinstance(error, EOFError) or re.search("truncated|EOF", str(error), re.IGNORECASE)
        reason = "is cut off: its end is missing" if cut else f"is damaged or of a rare kind ({error})"
        raise InputError(f"{path}: {' '.join(reason.split())}; {AGAIN} as a PNG") from error


def _no_pixels(path: Path, head: bytes) -> str | None:
    """Why a file that begins so cannot hold a picture in pixels, if so."""
    if not head:
        return f"is empty; {AGAIN}"
    if b"<svg" in head or path.suffix.lower() in (".svg", ".svgz"):
        kind = "SVG"
    elif head.lstrip().startswith((b"%PDF", b"%!PS", b"\xc5\xd0\xd3\xc6")):
        kind = "PDF or PostScript"
    else:
        return None
    return f"is a drawing in vectors ({kind}); convert it to a PNG"


def _unread(head: bytes) -> str:
    """Why a file that begins so was not recognised."""
    if head[4:8] == b"ftyp":
        return "is of a kind that cannot be read here (HEIC or alike); convert it to PNG or JPEG"
    if head.startswith((b"\x89PNG", b"\xff\xd8\xff", b"GIF8", b"RIFF", b"II*\0", b"MM\0*", b"BM")):
        return f"is cut off or damaged; {AGAIN}"
    return "cannot be read as a picture; use PNG or JPEG"


def _rgba(picture):
    """A picture of any mode in RGBA. Deep greys are brought to 8 bits, which Pillow would do by cutting them off."""
    from PIL import Image

    if picture.mode.startswith(("I", "F")):
        values = np.asarray(picture).astype(np.float64)
        known = np.isfinite(values)
        if not known.any():
            raise ValueError("no brightness is a number")
        values = np.where(known, values, np.median(values[known]))
        bright = Image.fromarray((255 * _scaled(values) + 0.5).astype(np.uint8)).convert("RGBA")
        clear = picture.info.get("transparency")
        if isinstance(clear, int):
            bright.putalpha(Image.fromarray(np.where(values == clear, 0, 255).astype(np.uint8)))
        return bright
    if picture.mode in ("YCbCr", "HSV", "CMYK"):
        picture = picture.convert("RGB")
    if picture.mode == "La":
        picture = picture.convert("LA")
    return picture.convert("RGBA")


def _scaled(values: np.ndarray) -> np.ndarray:
    """Deep greys in [0, 1]: of the least depth in bits that holds them; of light without bound, all but the glare."""
    values = values - min(values.min(), 0)
    top = values.max()
    if np.array_equal(values, np.round(values)):
        top = next((2**bits - 1 for bits in DEPTHS if top < 2**bits), top)
    elif top > 1:
        top = max(np.percentile(values, 99.5), 1)
    return np.clip(values / max(top, 1), 0, 1)
