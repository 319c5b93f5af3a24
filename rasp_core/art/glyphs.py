"""Letters as silhouettes, in the bold font that comes with matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..util.errors import InputError

FONT = "fonts/ttf/DejaVuSans-Bold.ttf"
HEIGHT = 0.8  # of a letter, in widths of its image
STRETCHED = 0.92  # of its share of a line, that a letter of a shorter word covers


def letters(words: Sequence[str], size: int, square: bool = False) -> list[np.ndarray]:
    """For each place in the longest words what is to be seen there, one picture from each: `(len(words), size, size)`.

    "CVPR", "2025" gives C and 2, V and 0, P and 2, R and 5. A shorter word is drawn as wide as the longest and cut into
    as many parts: "CVPR", "25" gives C and the left half of 2, V and its right half, and so on. All letters are of one
    height, so that they agree in views from the side; square : of one width too, for views from above. Pictures are
    bool. Raises InputError for no letters, one that the font does not have, or a part in which nothing is to be seen.
    """
    if not all(words):
        raise InputError(f"words need a letter at least, got {', '.join(map(repr, words))}")
    most = max(map(len, words))
    columns = [
        [_letter(letter, size, square) for letter in word] if len(word) == most else _parts(word, most, size)
        for word in words
    ]
    return [np.stack(pictures) for pictures in zip(*columns, strict=True)]


def _letter(letter: str, size: int, square: bool) -> np.ndarray:
    from PIL import Image

    drawn, high = _drawn(letter, size), round(HEIGHT * size)
    wide = high if square else min(round(high * drawn.width / drawn.height), size)
    image = Image.new("L", (size, size))
    image.paste(drawn.resize((wide, high)), ((size - wide) // 2, (size - high) // 2))
    return np.asarray(image) > 127


def _parts(word: str, count: int, size: int) -> list[np.ndarray]:
    """A word, stretched over so many pictures side by side."""
    from PIL import Image

    high, cell, line = round(HEIGHT * size), count * size / len(word), Image.new("L", (count * size, size))
    wide = round(STRETCHED * cell)
    for k, letter in enumerate(word):
        line.paste(_drawn(letter, size).resize((wide, high)), (round((k + 0.5) * cell - wide / 2), (size - high) // 2))
    parts = np.split(np.asarray(line) > 127, count, axis=1)
    if empty := [k for k, part in enumerate(parts, 1) if not part.any()]:
        raise InputError(f"part {empty[0]} of {count} of {word!r} would be empty; use a word of {count} letters")
    return parts


def _drawn(letter: str, size: int):
    """A letter's picture, cut to what it covers, finer than `size`."""
    import matplotlib
    from matplotlib.ft2font import FT2Font
    from PIL import Image, ImageDraw, ImageFont

    path = str(Path(matplotlib.get_data_path()) / FONT)
    if letter.isspace() or not FT2Font(path).get_char_index(ord(letter)):
        raise InputError(f"the font has no letter {letter!r} (U+{ord(letter):04X}); use another")
    drawn = Image.new("L", (4 * size, 4 * size))
    ImageDraw.Draw(drawn).text((size, size), letter, 255, font=ImageFont.truetype(path, 2 * size))
    return drawn.crop(drawn.getbbox())
