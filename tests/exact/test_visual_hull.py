"""Visual hulls against solids that are known."""

import numpy as np
import pytest

from rasp_core.exact.visual_hull import extrusion, visual_hull
from rasp_core.geometry.cameras import Camera, box_views
from rasp_core.geometry.containers import Container, box
from rasp_core.geometry.silhouette_edges import Views
from rasp_core.silhouettes import render_at_rest
from rasp_core.util.errors import InputError

RESOLUTION = 256


def disk(radius):
    """A disk of `radius` widths in the image's middle, antialiased."""
    steps = (np.arange(RESOLUTION) + 0.5) / RESOLUTION - 0.5
    distance = np.hypot(*np.meshgrid(steps, steps))
    return np.clip(0.5 + (radius - distance) * RESOLUTION, 0, 1)


def silhouettes(body, cameras):
    return render_at_rest(body, Views(cameras), RESOLUTION).numpy()


def test_three_disks_make_the_solid_of_steinmetz():
    hull = visual_hull([disk(0.3)] * 3, box_views(2.0, (0, 0, 0)))
    assert hull.volume == pytest.approx(8 * (2 - np.sqrt(2)) * 0.6**3, rel=0.005)


def test_the_hull_of_a_box_is_the_box():
    room = box((0.3, 0.2, 0.1))
    cameras = box_views(0.4, (0, 0, 0))
    hull = visual_hull(silhouettes(room.body, cameras), cameras)
    assert hull.volume == pytest.approx(room.volume, rel=0.01)
    assert hull.half_extents == pytest.approx([0.15, 0.1, 0.05], abs=0.001)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_the_hull_throws_the_silhouettes_that_it_is_made_of(projection):
    from data_fetch import vessels

    body = vessels()[0]
    angles = ((0, 0), (90, 0), (35, 40))
    cameras = [Camera(*angle, 0.2, tuple(body.centre), projection) for angle in angles]
    images = silhouettes(body, cameras)
    again = silhouettes(visual_hull(images, cameras), cameras)
    assert (np.abs(again - images) > 0.5).mean() < 0.001
    assert Container(visual_hull(images, cameras)).volume > body.volume


def test_holes_stay_holes():
    ring = disk(0.4) - disk(0.2)
    solid = extrusion(ring, Camera(20, 10, 1.0, (1, 2, 3)))
    assert solid.volume() == pytest.approx(np.pi * (0.4**2 - 0.2**2) * 2, rel=0.005)


@pytest.mark.parametrize(
    ("images", "cameras", "message"),
    [
        ([disk(0.3)], box_views(1.0, (0, 0, 0)), "got 1 for 3 views"),
        ([disk(0.3)[:, 1:]] * 3, box_views(1.0, (0, 0, 0)), r"square image, got one of shape \(256, 255\)"),
        ([disk(0.3), 0 * disk(0.3)], box_views(1.0, (0, 0, 0))[:2], "azimuth 90, elevation 0 is empty"),
        ([disk(0.3)] * 2, [Camera(0, 0, 1.0), Camera(180, 0, 1.0)], "azimuth 180, elevation 0.*leave one out"),
        ([np.roll(disk(0.1), 90, 0), np.roll(disk(0.1), -90, 0)], box_views(1.0, (0, 0, 0))[:2], "no point lies"),
    ],
)
def test_what_has_no_hull(images, cameras, message):
    with pytest.raises(InputError, match=message):
        visual_hull(images, cameras)
