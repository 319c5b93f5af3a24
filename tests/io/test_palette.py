"""Pictures in few colours look as they did; white stays white, and few colours stay as they are."""

import io

import numpy as np
import pytest
from PIL import Image

from rasp_core.io import palette


def shaded(size=200):
    """Balls of six hues on white, shaded smoothly: thousands of colours."""
    rows, columns = np.mgrid[:size, :size] / (size / 2) - 1
    light = np.sqrt(np.clip(1 - rows**2 - columns**2, 0, 1))[..., None]
    hues = np.array([[230, 80, 60], [60, 200, 90], [70, 90, 220], [220, 200, 60], [190, 70, 200], [60, 200, 210]])
    balls = [np.where(light > 0, light * hue, 255) for hue in hues]
    return np.concatenate(balls, 1).astype(np.uint8)


def read(data):
    with Image.open(io.BytesIO(data)) as picture:
        return picture.mode, np.asarray(picture.convert("RGB"))


def test_a_png_is_small_and_looks_as_it_did():
    pixels, plain = shaded(), io.BytesIO()
    Image.fromarray(pixels).save(plain, "PNG", optimize=True)
    data = palette.png(pixels)
    mode, seen = read(data)
    assert mode == "P"
    assert len(data) < 0.6 * len(plain.getvalue())
    apart = np.abs(seen.astype(int) - pixels)
    assert apart[(pixels < 255).any(2)].mean() < 5
    # the means of blocks are nearer than pixels are: the pattern takes bands away
    blocks = [image.reshape(25, 8, -1, 8, 3).mean((1, 3)) for image in (seen.astype(float), pixels.astype(float))]
    assert np.abs(blocks[0] - blocks[1]).mean() < 2.5
    assert np.array_equal((seen == 255).all(2), (pixels == 255).all(2)), "white stays white"


@pytest.mark.parametrize("colours", [[], [[10, 20, 30]], [[250, 20, 30], [0, 0, 0], [90, 180, 40]]])
def test_few_colours_stay_as_they_are(colours):
    pixels = np.full((40, 60, 3), 255, np.uint8)
    for k, colour in enumerate(colours):
        pixels[5:35, 10 * k + 5 : 10 * k + 12] = colour
    assert np.array_equal(read(palette.png(pixels))[1], pixels)


def test_a_film_has_one_palette_and_its_pictures_in_their_order(tmp_path):
    pictures = [np.roll(shaded(60), 20 * k, axis=1) for k in range(5)]
    palette.save_gif(tmp_path / "film.gif", pictures, seconds=1.0)
    with Image.open(tmp_path / "film.gif") as film:
        assert (film.n_frames, film.info["duration"], film.info["loop"]) == (5, 200, 0)
        for k, picture in enumerate(pictures):
            film.seek(k)
            shown = np.asarray(film.convert("RGB")).astype(int)
            assert np.abs(shown - picture).mean() < 6
            assert len(np.unique(shown.reshape(-1, 3), axis=0)) <= 64


def test_a_large_png_has_half_the_colours():
    pixels = shaded()
    whole = palette.png(pixels)
    assert palette.png(pixels, len(whole)) == whole
    data = palette.png(pixels, len(whole) - 1)
    assert len(data) < 0.9 * len(whole)
    assert (
        len(np.unique(read(data)[1].reshape(-1, 3), axis=0))
        <= 128
        < len(np.unique(read(whole)[1].reshape(-1, 3), axis=0))
    )
