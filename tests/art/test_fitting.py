"""Pictures that give way: compared with shifts that are undone, and with moves counted in pixels."""

import numpy as np
import pytest

from rasp_core.art.ceiling import hull_silhouettes
from rasp_core.art.fitting import Bounds, fit, moved
from rasp_core.geometry.cameras import Camera
from rasp_core.silhouettes import likeness
from rasp_core.util.errors import InputError

SIZE = 96
SIDES = [Camera(0, 0, 1.0), Camera(90, 0, 1.0)]


def block(top, bottom, left=30, right=66):
    picture = np.zeros((SIZE, SIZE), bool)
    picture[top:bottom, left:right] = True
    return picture


def test_a_picture_that_is_too_low_is_raised():
    pictures = np.stack([block(24, 72), block(32, 80)])
    fitted = fit(pictures, SIDES, Bounds(shift=0.1, scale=0, turn_deg=0))
    assert fitted.before == pytest.approx([40 / 48] * 2, abs=0.01)
    assert fitted.after.min() > 0.97
    # up, by 8 pixels in all
    assert fitted.moves[1, 1] - fitted.moves[0, 1] == pytest.approx(8 / SIZE, abs=1.5 / SIZE)
    there = fitted.apply(pictures)
    assert likeness(hull_silhouettes(there, SIDES), there) == pytest.approx(fitted.after)
    assert fitted.lines()[-1].startswith("the ceiling rose from 83.")
    assert len(fitted.to_dict()["moves"]) == 2


def test_bounds_are_kept_and_pictures_that_agree_stay():
    apart = np.stack([block(10, 40), block(50, 80)])
    with pytest.raises(InputError, match="no point lies in all silhouettes"):
        fit(apart, SIDES, Bounds())
    near = np.stack([block(10, 50), block(40, 80)])
    moves = fit(near, SIDES, Bounds(0.05, 0.1, 3)).moves
    assert (np.abs(moves - [0, 0, 1, 0]) <= np.array([0.05, 0.05, 0.1, 3]) + 1e-12).all()
    same = np.stack([block(20, 70), block(20, 70)])
    assert np.array_equal(fit(same, SIDES, Bounds()).moves, np.tile([0, 0, 1, 0], (2, 1)))


def test_moves_are_those_named():
    picture = block(40, 56, 40, 56)
    assert np.array_equal(moved(picture, np.array([12 / SIZE, 6 / SIZE, 1, 0])), block(34, 50, 52, 68))
    assert np.array_equal(moved(picture, np.array([0, 0, 2, 0])), block(32, 64, 32, 64))
    mark = block(40, 44, 60, 70)  # right of the middle and above it
    rows, columns = np.argwhere(moved(mark, np.array([0, 0, 1, 90]))).mean(0)
    assert (rows, columns) == pytest.approx((SIZE - 1 - 64.5, 41.5))  # counter-clockwise: above, and to the left
    colours = moved(np.zeros((SIZE, SIZE, 3)), np.array([0.25, 0, 1, 0]))
    assert colours[:, :24].min() == 1
    assert colours[:, 25:].max() == 0


def test_pictures_seen_otherwise_are_judged_as_seen():
    pictures = np.stack([block(24, 72), block(32, 80)])
    flipped = fit(pictures, SIDES, Bounds(0.1, 0, 0), seen=lambda images: images[:, ::-1])
    assert flipped.after.min() > 0.97


@pytest.mark.parametrize("wrong", [{"shift": -0.1}, {"scale": 0.6}, {"turn_deg": float("nan")}])
def test_bounds_make_sense(wrong):
    with pytest.raises(InputError, match="may be shifted by 0 to"):
        Bounds(**wrong)
