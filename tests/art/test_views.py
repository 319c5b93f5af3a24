"""Directions of views against the angles asked for."""

import pytest

from rasp_core.art.views import cameras_for
from rasp_core.util.errors import InputError


@pytest.mark.parametrize(("count", "azimuths"), [(2, [0, 90]), (3, [0, 120, 240]), (4, [0, 45, 90, 135])])
def test_directions_are_spread_where_none_are_given(count, azimuths):
    cameras = cameras_for(count)
    assert [camera.azimuth_deg for camera in cameras] == azimuths
    assert {camera.elevation_deg for camera in cameras} == {0}


def test_angles_width_and_projection_are_kept():
    first, second = cameras_for(2, [10, 20], [30, 40], width=0.5, projection="perspective")
    assert (first.azimuth_deg, first.elevation_deg) == (10, 30)
    assert (second.azimuth_deg, second.elevation_deg) == (20, 40)
    assert (second.width, second.projection, second.centre) == (0.5, "perspective", (0.0, 0.0, 0.0))


@pytest.mark.parametrize(("azimuths", "elevations", "got"), [([0], None, "1, 1"), (None, [0] * 3, "2, 3")])
def test_each_picture_needs_both_angles(azimuths, elevations, got):
    with pytest.raises(InputError, match=f"each of 2 pictures needs an azimuth and an elevation, got {got}"):
        cameras_for(2, azimuths, elevations)


def test_no_width_is_refused():
    with pytest.raises(InputError, match="width must be positive"):
        cameras_for(2, width=0.0)
