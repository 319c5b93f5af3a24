"""Coverings against their own pictures drawn anew, and against exact booleans."""

import numpy as np
import pytest

from data_fetch import kitchen_like
from rasp_core.art.greedy_cover import Covering, hull_points
from rasp_core.exact.certificate import certify
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.containers import box
from rasp_core.geometry.meshes import unique_names
from rasp_core.poses import file_to_world

CAMERAS = [Camera(0, 0, 1.0), Camera(90, 0, 1.0)]
SIZE = 128


def disk(radius):
    steps = (np.arange(SIZE) + 0.5) / SIZE - 0.5
    return np.hypot(steps[:, None], steps) < radius


@pytest.fixture(scope="module")
def filled():
    covering = Covering(kitchen_like(12), CAMERAS, np.stack([disk(0.35)] * 2), seed=0)
    covering.reset(0.9)
    assert covering.fill(40, least_gain=8.0) > 10
    return covering


def test_the_pictures_come_out_and_nothing_overlaps(filled):
    assert filled.likeness.min() > 0.85
    bodies = unique_names([filled.pool[i] for i in filled.chosen])
    matrices = file_to_world(bodies, filled.poses.rotation, filled.poses.translation)
    assert certify(bodies, matrices, box([filled.width] * 3)).holds


def test_dark_is_what_is_drawn(filled):
    dark = filled.dark.copy()
    filled.set_bodies(filled.chosen, filled.poses)
    assert (dark != filled.dark).mean() < 1e-3


def test_a_reset_takes_all_away_and_gives_the_same_again():
    covering = Covering(kitchen_like(6), CAMERAS, np.stack([disk(0.35)] * 2), seed=3)
    found = []
    for _ in range(2):
        covering.reset(0.7)
        covering.fill(4, least_gain=8.0)
        found.append(covering.translation)
    assert len(found[0]) == 4
    assert np.array_equal(*found)


def test_filling_ends_if_little_is_gained_and_if_nothing_is_open():
    covering = Covering(kitchen_like(6), CAMERAS, np.stack([disk(0.35)] * 2), seed=0)
    covering.reset(0.7)
    assert covering.fill(5, least_gain=1e9) == 0
    covering.dark = covering.wanted.copy()
    assert covering.fill(5, least_gain=0.0) == 0


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_hull_points_are_dark_in_all_pictures(projection):
    cameras = [Camera(a, 0, 1.0, projection=projection) for a in (0, 90)] + [Camera(0, 90, 1.0, projection=projection)]
    points, pixels = hull_points(np.stack([disk(0.3)] * 3), cameras)
    assert np.isin(pixels, np.flatnonzero(disk(0.3))).all()
    if projection == "orthographic":  # the solid of Steinmetz
        assert len(points) / 128**3 == pytest.approx(8 * (2 - np.sqrt(2)) * 0.3**3, rel=0.02)
