"""In the dark rooms, shadows on the walls are those that the views see."""

from dataclasses import replace

import numpy as np
import pytest

from data_fetch import kitchen_like
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.containers import box
from rasp_core.optimizer import optimize
from rasp_core.problem import Problem, Settings
from rasp_core.visualize import installations


@pytest.fixture(scope="module")
def heap():
    room = box((0.3, 0.3, 0.3))
    run = optimize(Problem(kitchen_like(3), room), Settings(iterations=2, resolution=64))
    front, side, top = (Camera(azimuth, elevation, 0.5) for azimuth, elevation in ((0, 0), (90, 0), (0, 90)))
    return replace(run, cameras=[front, side, top])


def bright(picture):
    return (picture.min(-1) > 150).mean()


def dark(picture):
    return (picture.max(-1) < 60).mean()


def test_rooms_are_dark_but_for_lit_walls_and_have_colours(heap):
    row = installations.row([replace(heap, cameras=[heap.cameras[0], heap.cameras[2]])] * 2, 200)
    for picture in (row, installations.before_wall(heap, 0, 160)):
        assert max(picture.shape) in (200, 160)
        assert bright(picture) > 0.1
        assert dark(picture) > 0.1
        assert (np.ptp(picture.astype(int), axis=2) > 80).mean() > 0.01


def test_two_stacked_heaps_stand_in_orange_light(heap):
    picture = installations.stacked(heap, heap, 200).astype(int)
    lit = picture.max(-1) > 150
    assert lit.mean() > 0.1
    assert (picture[lit][:, 0] > picture[lit][:, 2] + 40).mean() > 0.95


def test_a_full_box_has_dark_shadows_and_a_gap_a_spot_of_light():
    import trimesh

    from rasp_core.geometry.meshes import make_body

    cube = trimesh.creation.box([0.0999] * 3)
    block, room = make_body("block", cube.vertices, cube.faces), box((0.3, 0.3, 0.3))
    spots = [np.array(spot) for spot in np.ndindex(3, 3, 3)]
    pictures = []
    for missing in ((), (1, 1)):
        kept = [spot for spot in spots if tuple(spot[::2]) != missing]
        matrices = np.tile(np.eye(4), (len(kept), 1, 1))
        matrices[:, :3, 3] = 0.1 * (np.array(kept) - 1)
        grey = np.full((len(kept), 3), 0.1)
        pictures.append(installations.box_corner([block] * len(kept), matrices, room, grey, 200))
    full, gap = (picture.astype(int).min(-1) for picture in pictures)
    spot = gap > full + 100
    assert 0.003 < spot.mean() < 0.05
    assert (full > gap + 100).mean() < 0.002
    assert np.median(np.nonzero(spot)[1]) > 120, "on the front's wall, to the right"


def test_shades_are_of_one_hue_and_differ():
    from matplotlib.colors import rgb_to_hsv

    shades = installations.shades((0.8, 0.4, 0.3), 9)
    assert shades.shape == (9, 3)
    assert np.linalg.norm(np.diff(shades, axis=0), axis=1).min() > 0.02
    assert np.ptp(rgb_to_hsv(shades)[:, 0]) < 0.05


def test_walls_meet_in_the_corner_and_reach_far_elsewhere():
    views = [Camera(0, 0, 1.0), Camera(90, 0, 1.0), Camera(0, 90, 1.0)]
    walls = [installations.wall(view, 0.7, *installations._extents(view, views, 0.7)) for view in views]
    corner = np.array([-0.7, 0.7, -0.7])  # behind what all three look at
    for wall in walls:
        assert np.linalg.norm(wall.vertices - corner, axis=1).min() < 1e-9
        assert np.ptp(wall.vertices, axis=0).max() > 5
