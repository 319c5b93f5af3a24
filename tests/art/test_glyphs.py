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


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["CVPR", "202"], "as many letters as each other, got 'CVPR', '202'"),
        (["", ""], "as many letters"),
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
