import shutil

import numpy as np
import pytest
from oracles import read_letters

from rasp_core.art.glyphs import HEIGHT, letters
from rasp_core.util.errors import InputError


def test_words_are_read_column_by_column():
    found = letters(["CVPR", "2025"], 64)
    assert len(found) == 4
    assert all(pair.shape == (2, 64, 64) and pair.dtype == bool for pair in found)
    assert np.array_equal(found[0][1], found[2][1]), "both are a 2"


@pytest.mark.parametrize("square", [False, True])
def test_all_letters_are_of_one_height(square):
    for image in letters(list("GEI"), 200, square)[0]:
        rows, columns = (np.flatnonzero(image.any(axis)) for axis in (1, 0))
        assert abs(np.ptp(rows) + 1 - HEIGHT * 200) <= 1
        assert not square or abs(np.ptp(columns) + 1 - HEIGHT * 200) <= 2
        assert abs(columns.mean() - 99.5) <= 1


@pytest.mark.parametrize(("long", "short"), [("CVPR", "25"), ("RASP", "TOY"), ("CVPR", "A")])
def test_a_shorter_word_is_stretched_over_all_places(long, short):
    found = letters([long, short], 96)
    assert len(found) == len(long)
    assert np.array_equal([pair[0] for pair in found], [pair[0] for pair in letters([long], 96)])
    line = np.concatenate([pair[1] for pair in found], axis=1)
    rows, columns = (np.flatnonzero(line.any(axis)) for axis in (1, 0))
    assert abs(np.ptp(rows) + 1 - HEIGHT * 96) <= 1
    assert abs(columns.mean() - (line.shape[1] - 1) / 2) <= 3
    assert all(pair[1].any() for pair in found)


def test_a_part_in_which_nothing_is_to_be_seen_is_refused(monkeypatch):
    """Two letters over ten parts, drawn narrow: they leave the other parts empty."""
    monkeypatch.setattr("rasp_core.art.glyphs.STRETCHED", 0.05)
    with pytest.raises(InputError, match="part 1 of 10 of 'II' would be empty; use a word of 10 letters"):
        letters(["ABCDEFGHIJ", "II"], 48)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["", ""], "words need a letter at least, got '', ''"),
        (["CVPR", ""], "words need a letter at least"),
        (["A", "\U00012000"], r"no letter .* \(U\+12000\)"),
        (["A", " "], r"no letter ' '"),
    ],
)
def test_words_that_cannot_be_shown(words, message):
    with pytest.raises(InputError, match=message):
        letters(words, 64)


@pytest.mark.skipif(shutil.which("tesseract") is None, reason="tesseract is not installed; .ci/run installs it")
@pytest.mark.parametrize("word", ["CVPR", "2025"])
def test_letters_are_read_by_tesseract(word):
    assert read_letters([image[0] for image in letters([word], 512)]) == word


@pytest.mark.skipif(shutil.which("tesseract") is None, reason="tesseract is not installed; .ci/run installs it")
def test_a_stretched_word_is_read_once_its_parts_stand_side_by_side():
    line = np.concatenate([pair[1] for pair in letters(["CVPR", "25"], 256)], axis=1)
    halves = [np.pad(half[:, ::2], ((0, 0), (128, 128))) for half in np.split(line, 2, axis=1)]
    assert read_letters(halves) == "25"
