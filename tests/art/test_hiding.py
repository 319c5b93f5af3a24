"""What no view sees, compared with distances counted by hand."""

import numpy as np
import pytest

from rasp_core.art.hiding import Hiding
from rasp_core.geometry.cameras import PERSPECTIVE_DISTANCE, Camera
from rasp_core.util.errors import InputError

SIZE = 64
SIDES = [Camera(0, 0, 1.0), Camera(90, 0, 1.0)]


@pytest.fixture
def square():
    """A dark square of half the width, a quarter above the middle and a quarter below, in each view."""
    dark = np.zeros((2, SIZE, SIZE), bool)
    dark[:, 16:48, 16:48] = True
    return dark


def test_the_clearance_is_the_distance_to_what_is_light(square):
    hiding = Hiding.of(square, square, SIDES)
    points = np.array([[0, 0, 0], [0.15, 0, 0.1], [0.0, 0.2, 0.0], [0.24, 0.2, 0.2]])
    # a square of half extent 1/4; it is open below
    expected = [0.25, 0.1, 0.05, 0.01]
    assert hiding.clearance(points) == pytest.approx(expected, abs=0.6 / SIZE)
    assert (hiding.clearance(np.array([[0.3, 0, 0], [0, 0, 0.3], [0, -0.45, 0]])) < 0).all()


def test_below_the_pictures_all_is_hidden(square):
    hiding = Hiding.of(square, square, SIDES)
    assert list(hiding.bottom) == [48, 48]
    assert (hiding.clearance(np.array([[0.45, 0.4, -0.4], [0, 0, -0.9], [0.8, 0.8, -0.5]])) > 0.1).all()


def test_what_the_heap_spills_below_its_pictures_does_not_lower_their_end(square):
    there = square.copy()
    there[0, 48:52, 20:22] = True
    assert list(Hiding.of(square, there, SIDES).bottom) == [48, 48]


def test_from_above_the_shadow_falls_on_the_base(square):
    views = [SIDES[0], Camera(0, 90, 1.0)]
    hiding = Hiding.of(square, square, views)
    assert list(hiding.bottom) == [48, SIZE]
    assert hiding.clearance(np.array([[0, 0.45, -0.6]]))[0] < 0
    assert hiding.base_top(np.array([-0.5] * 3), np.array([0.5] * 3)) == pytest.approx(-0.25, abs=1 / SIZE)


def test_a_base_is_lower_where_views_look_down_on_it(square):
    low, high = np.array([-0.25, -0.25, -0.25]), np.array([0.25, 0.25, 0.25])
    level = Hiding.of(square, square, SIDES).base_top(low, high)
    tilted = Hiding.of(square, square, [SIDES[0], Camera(90, 30, 1.0)]).base_top(low, high)
    # up in the picture is sin 30 along the view and cos 30 up: its far edge is as low as the picture's last row
    assert level == pytest.approx(-0.25, abs=1 / SIZE)
    assert tilted == pytest.approx(-(0.25 + 0.25 * 0.5) / np.cos(np.radians(30)), abs=2 / SIZE)


def test_an_eye_sees_what_is_near_it_larger(square):
    views = [Camera(azimuth, 0, 1.0, projection="perspective") for azimuth in (0, 90)]
    hiding = Hiding.of(square, square, views)
    near, far = hiding.clearance(np.array([[0, -0.2, 0.24], [0, 0.2, 0.24]]))
    assert near < 0.9 * 0.25 * (1 - 0.2 / PERSPECTIVE_DISTANCE) - 0.2
    assert far > near


@pytest.mark.parametrize(
    ("elevations", "says"), [((0, -60), "would stand before the view"), ((-45, 45), "no base stays below all pictures")]
)
def test_no_base_before_a_view(square, elevations, says):
    views = [Camera(90 * k, elevation, 1.0) for k, elevation in enumerate(elevations)]
    with pytest.raises(InputError, match=says):
        Hiding.of(square, square, views).base_top(np.array([-2.0, -2, -0.3]), np.array([2.0, 2, 0.3]))
