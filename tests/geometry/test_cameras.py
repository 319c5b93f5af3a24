"""The named views, and the rays through their pixels."""

import numpy as np
import pytest

from rasp_core.geometry.cameras import Camera, box_views, spread_views
from rasp_core.util.errors import InputError


@pytest.mark.parametrize(
    ("azimuth", "elevation", "right", "up", "forward"),
    [
        (0, 0, (1, 0, 0), (0, 0, 1), (0, 1, 0)),
        (90, 0, (0, 1, 0), (0, 0, 1), (-1, 0, 0)),
        (0, 90, (1, 0, 0), (0, 1, 0), (0, 0, -1)),
        (180, 0, (-1, 0, 0), (0, 0, 1), (0, -1, 0)),
    ],
)
def test_named_directions(azimuth, elevation, right, up, forward):
    assert Camera(azimuth, elevation, 1).axes == pytest.approx(np.array([right, up, forward]), abs=1e-12)


def test_an_orthographic_image_covers_the_cubes_face():
    origins, directions = Camera(0, 0, 2, (1, 2, 3)).rays(4)
    assert origins[0, 0, [0, 2]] == pytest.approx([0.25, 3.75]), "row 0 is on top, column 0 on the left"
    assert origins[3, 3, [0, 2]] == pytest.approx([1.75, 2.25])
    assert directions == pytest.approx(np.broadcast_to([0, 1, 0], (4, 4, 3)), abs=1e-12)


def test_perspective_rays_meet_in_the_eye_and_span_the_width_at_the_centre():
    camera = Camera(30, 20, 2, (1, 2, 3), "perspective")
    origins, directions = camera.rays(2)
    assert origins == pytest.approx(np.broadcast_to(camera.eye[:3], (2, 2, 3)))
    distance = np.linalg.norm(camera.eye[:3] - [1, 2, 3])
    assert distance == pytest.approx(4)
    on_plane = origins + directions * (distance / (directions @ camera.axes[2]))[..., None]
    assert np.linalg.norm(on_plane[0, 0] - on_plane[0, 1]) == pytest.approx(1), "half the width between two pixels"


@pytest.mark.parametrize("bad", [{"projection": "fisheye"}, {"width": 0}, {"width": np.inf}, {"azimuth_deg": np.nan}])
def test_impossible_views_are_refused(bad):
    with pytest.raises(InputError):
        Camera(**{"azimuth_deg": 0, "elevation_deg": 0, "width": 1, **bad})


def test_box_views_are_its_three_faces():
    forwards = [camera.axes[2] for camera in box_views(1, (0, 0, 0))]
    assert np.abs(np.array(forwards)) == pytest.approx(np.eye(3)[[1, 0, 2]], abs=1e-12)


def test_spread_views_are_never_close_to_each_other_or_opposite():
    forwards = np.array([camera.axes[2] for camera in spread_views(5, 1, (0, 0, 0))])
    nearest = np.abs(forwards @ forwards.T - np.eye(5)).max()
    assert np.degrees(np.arccos(nearest)) > 35
    with pytest.raises(InputError, match="at least one view"):
        spread_views(0, 1, (0, 0, 0))


def test_views_as_plain_numbers():
    assert Camera(1, 2, 3, (4, 5, 6)).to_dict() == {
        "azimuth_deg": 1,
        "elevation_deg": 2,
        "width": 3,
        "centre": [4.0, 5.0, 6.0],
        "projection": "orthographic",
    }
