"""Occluders against the dispute that they are put for, found anew by another way of looking."""

import numpy as np
import pytest
import torch
import trimesh

from data_fetch import kitchen_like
from rasp_core.art.greedy_cover import Covering
from rasp_core.art.occluders import add_occluders
from rasp_core.art.texturing import Canvas
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.meshes import make_body
from rasp_core.poses import Poses, file_to_world

CAMERAS = [Camera(0, 0, 1.0), Camera(90, 0, 1.0)]
SIZE = 128


def plain(first, second):
    return np.stack([np.full((SIZE, SIZE, 3), value) for value in (first, second)])


@pytest.fixture(scope="module")
def heap():
    square = np.zeros((SIZE, SIZE), bool)
    square[20:-20, 20:-20] = True
    covering = Covering(kitchen_like(20), CAMERAS, np.stack([square] * 2), seed=0)
    covering.reset(1.2)
    covering.fill(40, least_gain=8.0)
    return covering


def noise(covering, colours):
    bodies = [covering.pool[i] for i in covering.chosen]
    matrices = file_to_world(bodies, covering.poses.rotation, covering.poses.translation)
    canvas = Canvas(bodies, matrices, covering.cameras, SIZE)
    return canvas.paint(colours).psnr.min()


def test_occluders_end_disputes_and_leave_the_pictures(heap):
    colours, before, alike = plain(0.1, 0.9), noise(heap, plain(0.1, 0.9)), heap.likeness.min()
    count, most = len(heap.chosen), add_occluders(heap, colours, 0)
    left = add_occluders(heap, colours, 60)
    assert len(heap.chosen) > count
    assert left < 0.75 * most
    assert noise(heap, colours) > before + 1
    assert heap.likeness.min() > alike - 0.01


def test_one_colour_for_all_leaves_nothing_to_dispute(heap):
    count = len(heap.chosen)
    assert add_occluders(heap, plain(0.4, 0.4), 5) == 0
    assert len(heap.chosen) == count


def test_the_dispute_of_a_ball_is_what_its_sides_share():
    mesh = trimesh.creation.icosphere(4, 0.3)
    covering = Covering([make_body("ball", mesh.vertices, mesh.faces)], CAMERAS, np.ones((2, SIZE, SIZE)), seed=0)
    covering.set_bodies([0], Poses(torch.eye(3)[None].double(), torch.zeros(1, 3).double()))
    # the other view sees half of a disk; one colour leaves each picture a quarter of the square difference there
    assert add_occluders(covering, plain(0.0, 1.0), 0) == pytest.approx(0.5 / 4, rel=0.03)


def test_occluders_stay_in_all_pictures():
    """Beyond its picture a view sees no shadow, but everyone else sees an object there."""
    square = np.zeros((SIZE, SIZE), bool)
    square[30:-30, 4:-4] = True
    cameras = [Camera(azimuth, 0, 1.0) for azimuth in (0, 120, 240)]
    covering = Covering(kitchen_like(20), cameras, np.stack([square] * 3), seed=0)
    covering.reset(1.0)
    covering.fill(30, least_gain=8.0)
    count = len(covering.chosen)
    add_occluders(covering, np.stack([np.full((SIZE, SIZE, 3), value) for value in (0.0, 0.5, 1.0)]), 40)
    assert len(covering.chosen) > count
    places = zip(covering.chosen, covering.rotation, covering.translation, strict=True)
    placed = np.concatenate([covering.pool[i].solid_vertices @ turn.T + place for i, turn, place in places])
    for camera in covering.cameras:
        assert np.abs(placed @ camera.axes[:2].T).max() < camera.width * (0.5 + 1 / SIZE)
