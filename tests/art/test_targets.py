"""Targets against pictures and letters that are known."""

import numpy as np
import pytest
from PIL import Image

from rasp_core.art.glyphs import letters
from rasp_core.art.targets import from_files, from_text
from rasp_core.util.errors import InputError


def test_a_picture_file_gives_what_is_dark_and_its_colours(tmp_path):
    pixels = np.full((64, 64, 3), 255, np.uint8)
    pixels[16:48, 16:48] = 40, 80, 200
    Image.fromarray(pixels).save(tmp_path / "blue.png")
    targets = from_files([tmp_path / "blue.png"] * 2, resolution=64)
    wanted = np.zeros((64, 64), bool)
    wanted[16:48, 16:48] = True
    assert np.array_equal(targets.pictures, [wanted] * 2)
    assert targets.colours[1, 30, 30] == pytest.approx(np.array([40, 80, 200]) / 255)


def test_each_place_in_the_words_is_a_sculpture_without_colours():
    found = from_text(["AB", "12"], resolution=48)
    assert np.array_equal([one.pictures for one in found], letters(["AB", "12"], 48))
    assert [one.colours for one in found] == [None, None]


def test_letters_seen_from_above_are_as_wide_as_high():
    narrow, wide = (from_text(["I"], 48, square)[0].pictures[0].any(0).sum() for square in (False, True))
    assert narrow < wide


def test_few_pixels_are_refused():
    with pytest.raises(InputError, match="resolution must be at least 32, got 4"):
        from_text(["A"], resolution=4)
    with pytest.raises(InputError, match="resolution must be at least 32, got 31"):
        from_files(["none.png"], resolution=31)
