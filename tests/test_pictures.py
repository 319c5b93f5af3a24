"""Pictures of one shape, drawn in different ways."""

import numpy as np
import pytest
from PIL import Image

from rasp_core.errors import InputError
from rasp_core.pictures import read_silhouettes

SHAPE = np.zeros((32, 32), np.uint8)
SHAPE[8:20, 10:14] = 255


def save(path, pixels):
    Image.fromarray(pixels).save(path)
    return path


def test_dark_on_light_light_on_dark_and_alpha_are_the_same(tmp_path):
    clear = np.zeros((32, 32, 4), np.uint8)
    clear[..., 3] = SHAPE
    paths = [save(tmp_path / f"{k}.png", p) for k, p in enumerate((SHAPE, 255 - SHAPE, clear, 40 + SHAPE // 2))]
    for image in read_silhouettes(paths):
        assert np.array_equal(image > 0.5, SHAPE > 0)


def test_what_is_no_silhouette(tmp_path):
    (tmp_path / "text.png").write_text("no picture")
    cases = {
        "no such picture": [tmp_path / "none.png"],
        "cannot be read as a picture": [tmp_path / "text.png"],
        "one brightness only": [save(tmp_path / "black.png", 0 * SHAPE)],
        "square and of one size.*32 x 30": [save(tmp_path / "flat.png", SHAPE[:30])],
        "square and of one size.*16 x 16": [
            save(tmp_path / "large.png", SHAPE),
            save(tmp_path / "small.png", np.ascontiguousarray(SHAPE[4:20, 4:20])),
        ],
    }
    for message, paths in cases.items():
        with pytest.raises(InputError, match=message):
            read_silhouettes(paths)
