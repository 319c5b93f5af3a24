"""Text of mesh files in any encoding and with any line ends; words that are no numbers are named."""

import codecs

import numpy as np
import pytest

from rasp_core.io.text import decoded, floats, integers
from rasp_core.util.errors import MeshError


@pytest.mark.parametrize(
    "data",
    [
        "é\nb".encode(),
        "é\r\nb".encode("latin-1"),
        "é\rb".encode("utf-8-sig"),
        "é\nb".encode("utf-16"),
        codecs.BOM_UTF16_BE + "é\nb".encode("utf-16-be"),
        "é\nb".encode("utf-32"),
    ],
)
def test_encodings_and_line_ends(data):
    assert decoded(data) == "é\nb"


def test_a_mark_that_lies():
    with pytest.raises(MeshError, match="not the utf-16 that it claims"):
        decoded(codecs.BOM_UTF16_LE + b"abc")


def test_numbers():
    np.testing.assert_array_equal(floats(["1", "-2.5e3", b"4."]), [1, -2500, 4])
    np.testing.assert_array_equal(integers(["1", b"-2"]), [1, -2])
    assert floats([]).shape == integers([]).shape == (0,)


@pytest.mark.parametrize(
    ("read", "words", "says"),
    [
        (floats, ["1", "0,5"], r"decimal comma \(0,5\)"),
        (floats, ["1", "x"], "'x' stands where a number"),
        (floats, [b"1", b"\xff"], "stands where a number"),
        (integers, ["1", "2.5"], "'2.5' stands where a whole number"),
        (integers, ["1", "9" * 20], "9999' stands where a whole number"),
    ],
)
def test_words_that_are_none(read, words, says):
    with pytest.raises(MeshError, match=says):
        read(words)
