"""Letters as silhouettes, in the bold font that comes with matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..util.errors import InputError

FONT = "fonts/ttf/DejaVuSans-Bold.ttf"
HEIGHT = 0.8  # of a letter, in widths of its image


def letters(words: Sequence[str], size: int, square: bool = False) -> list[np.ndarray]:
    """For each place in the words, the letters there, one from each word: `(len(words), size, size)` bool.

    All letters are of one height, so that they agree in views from the side; square : of one width too, for views
    from above. "CVPR", "2025" gives C and 2, V and 0, P and 2, R and 5. Raises InputError for words of different
    lengths, or a letter that the font does not have.
    """
    if len({len(word) for word in words}) != 1 or not words[0]:
        raise InputError(f"words need as many letters as each other, got {', '.join(map(repr, words))}")
    return [np.stack([_letter(letter, size, square) for letter in column]) for column in zip(*words, strict=True)]


def _letter(letter: str, size: int, square: bool) -> np.ndarray:
    import matplotlib
    from matplotlib.ft2font import FT2Font
    from PIL import Image, ImageDraw, ImageFont

    path = str(Path(matplotlib.get_data_path()) / FONT)
    if letter.isspace() or not FT2Font(path).get_char_index(ord(letter)):
        raise InputError(f"the font has no letter {letter!r} (U+{ord(letter):04X}); use another")
    font = ImageFont.truetype(path, 2 * size)
    drawn = Image.new("L", (4 * size, 4 * size))
    ImageDraw.Draw(drawn).text((size, size), letter, 255, font=font)
    drawn = drawn.crop(drawn.getbbox())
    high = round(HEIGHT * size)
    wide = high if square else min(round(high * drawn.width / drawn.height), size)
    image = Image.new("L", (size, size))
    image.paste(drawn.resize((wide, high)), ((size - wide) // 2, (size - high) // 2))
    return np.asarray(image) > 127
