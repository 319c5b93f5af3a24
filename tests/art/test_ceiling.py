"""What pictures allow, for pictures whose visual hull is known."""

import numpy as np
import pytest

from rasp_core.art.ceiling import disagreements, hull_silhouettes
from rasp_core.geometry.cameras import Camera
from rasp_core.util.errors import InputError

SIDES = [Camera(0, 0, 1.0), Camera(90, 0, 1.0)]


def test_the_ceiling_is_the_pictures_where_they_agree_and_less_where_not():
    tall, low = np.zeros((2, 64, 64), bool)
    tall[8:56, 20:44] = True
    low[32:56, 20:44] = True
    assert np.array_equal(hull_silhouettes(np.stack([tall, tall]), SIDES), np.stack([tall, tall]))
    hull = hull_silhouettes(np.stack([tall, low]), SIDES)
    assert np.array_equal(hull[0], low)
    (line,) = disagreements(np.stack([tall, low]), hull, SIDES)
    assert line.startswith(
        "the picture at azimuth 0, elevation 0 can be met to 50.0% at most; 24 of its rows are empty"
    )
    above = [SIDES[0], Camera(0, 90, 1.0)]
    assert "rows" not in disagreements(np.stack([tall, low]), hull, above)[0]


def test_pictures_that_agree_have_no_lines():
    square = np.zeros((2, 32, 32), bool)
    square[:, 8:24, 8:24] = True
    assert disagreements(square, hull_silhouettes(square, SIDES), SIDES) == []


@pytest.mark.parametrize("count", [1, 5])
def test_two_to_four_views(count):
    with pytest.raises(InputError, match=f"two to four views, got {count}"):
        hull_silhouettes(np.ones((count, 8, 8), bool), SIDES)
