"""Pictures of one shape, drawn in different ways."""

import numpy as np
import pytest
from PIL import Image

from rasp_core.io.images import read_silhouettes, read_targets
from rasp_core.util.errors import InputError

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


def ring(size, inner, outer):
    steps = np.arange(size) + 0.5 - size / 2
    distance = np.hypot(steps[:, None], steps)
    return (distance < outer) & (distance > inner)


def test_targets_by_alpha_by_paper_and_by_an_even_background(tmp_path):
    disk = ring(64, -1, 20)
    alpha = np.tile([200, 30, 30, 0], (64, 64, 1))
    alpha[disk, 3] = 255
    paper = np.where(disk, 240, 255)[..., None].repeat(3, 2)
    night = np.where(disk, 220, 20)[..., None].repeat(3, 2)
    paths = [save(tmp_path / f"{k}.png", image.astype(np.uint8)) for k, image in enumerate((alpha, paper, night))]
    dark, colours = read_targets(paths, 64)
    assert dark.shape == (3, 64, 64)
    assert all(np.array_equal(image, disk) for image in dark)
    assert colours[0, 32, 32] == pytest.approx([200 / 255, 30 / 255, 30 / 255], abs=0.01)
    assert np.allclose(colours[0, 0, 0], 1), "white where alpha is 0"


def test_a_photograph_is_dark_all_over(tmp_path):
    noise = np.random.default_rng(0).integers(0, 240, (40, 60, 3)).astype(np.uint8)
    dark, colours = read_targets([save(tmp_path / "photo.png", noise)], 32)
    assert dark.all()
    assert colours.shape == (1, 32, 32, 3)


@pytest.mark.parametrize("value", [255, 128, 0])
def test_a_blank_target_is_refused(tmp_path, value):
    with pytest.raises(InputError, match=r"blank\.png: is blank"):
        read_targets([save(tmp_path / "blank.png", np.full((20, 20, 3), value, np.uint8))], 32)


def test_targets_that_are_no_pictures(tmp_path):
    (tmp_path / "text.png").write_text("no picture")
    with pytest.raises(InputError, match="cannot be read as a picture"):
        read_targets([tmp_path / "text.png"], 32)
    with pytest.raises(InputError, match="no such picture"):
        read_targets([tmp_path / "none.png"], 32)
