"""Text of mesh files: its encoding, its line ends, its numbers."""

from __future__ import annotations

import codecs
import re
from collections.abc import Sequence

import numpy as np

from ..util.errors import MeshError

BOMS = (
    (codecs.BOM_UTF32_LE, "utf-32"),  # before UTF-16, whose mark it begins with
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


def decoded(data: bytes) -> str:
    """The text of a file: by its byte order mark, else UTF-8, else Latin-1. All line ends become one newline.

    Raises MeshError where the text breaks the rules of the encoding that its mark names.
    """
    encoding = next((name for mark, name in BOMS if data.startswith(mark)), None)
    try:
        text = data.decode(encoding or "utf-8")
    except UnicodeDecodeError as error:
        if encoding:
            raise MeshError(f"its text is not the {encoding} that it claims to be; export the mesh again") from error
        text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def floats(tokens: Sequence[str | bytes]) -> np.ndarray:
    """Numbers `(N,)` float64 of as many words. Raises MeshError naming the first word that is none."""
    try:
        return np.array(list(map(float, tokens)), np.float64)
    except ValueError:
        word = _shown(next(token for token in tokens if not _is(float, token)))
    if re.fullmatch(r"[-+]?\d+,\d+([eE][-+]?\d+)?,?", word):
        raise MeshError(f"its numbers have a decimal comma ({word}); export the mesh with decimal points")
    raise MeshError(f"{word[:40]!r} stands where a number should; export the mesh again")


def integers(tokens: Sequence[str | bytes]) -> np.ndarray:
    """Whole numbers `(N,)` int64 of as many words. Raises MeshError naming the first word that is none."""
    try:
        return np.array(list(map(int, tokens)), np.int64)
    except ValueError:
        word = _shown(next(token for token in tokens if not _is(int, token)))
    except OverflowError:
        word = _shown(max(tokens, key=len))
    raise MeshError(f"{word[:40]!r} stands where a whole number should; export the mesh again")


def _shown(word: str | bytes) -> str:
    return word.decode("utf-8", "replace") if isinstance(word, bytes) else word


def _is(kind: type, word: str | bytes) -> bool:
    try:
        kind(word)
    except ValueError:
        return False
    return True
