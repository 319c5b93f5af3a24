"""Slices of fields beside distances by formula."""

import numpy as np
import pytest
import torch
import trimesh
from matplotlib.figure import Figure

from rasp_core.geometry.meshes import make_body
from rasp_core.poses import Poses
from rasp_core.visualize import fields, style


@pytest.fixture(scope="module")
def two_balls():
    ball = trimesh.creation.icosphere(4, 0.1)
    bodies = [make_body(name, ball.vertices, ball.faces) for name in "ab"]
    poses = Poses(torch.eye(3).repeat(2, 1, 1), torch.tensor([[-0.05, 0.0, 0.0], [0.05, 0.0, 0.02]]))
    return fields.across(bodies, poses, (-0.2, -0.15), (0.2, 0.15), 0.0, 80)


def test_a_slice_is_the_distance_to_each_ball_row_0_on_top(two_balls):
    assert two_balls.shape == (2, 60, 80)
    x, z = np.meshgrid(np.linspace(-0.2, 0.2, 80), np.linspace(0.15, -0.15, 60))
    for found, (left, up) in zip(two_balls, ((-0.05, 0.0), (0.05, 0.02)), strict=True):
        exact = np.hypot(x - left, z - up) - 0.1
        near = exact < 0.01  # beyond its grid it is an upper bound
        assert np.abs(found - exact)[near].max() < 0.003
        assert (found >= exact - 0.003).all()


def test_inside_is_purple_and_outside_green(two_balls):
    colours = fields.shaded(two_balls[0])
    inside, outside = colours[two_balls[0] < -0.05], colours[two_balls[0] > 0.1]
    assert (inside[:, 1] < inside[:, [0, 2]].min(1)).all()
    assert (outside[:, 1] > outside[:, [0, 2]].max(1)).all()


def test_points_in_both_are_red_and_counted(two_balls):
    axis = Figure().subplots()
    one, both = fields.draw_points(axis, two_balls, step=2)
    inside = (two_balls[:, 1::2, 1::2] < 0).sum(0)
    assert (one, both) == ((inside == 1).sum(), (inside == 2).sum())
    assert both > 50
    red = axis.collections[2]
    assert np.allclose(red.get_facecolor()[0, :3], style.OVERLAP)
    assert len(red.get_offsets()) == both


def test_lines_are_drawn_where_there_is_an_inside(two_balls):
    axis = Figure().subplots()
    fields.draw_lines(axis, two_balls[0])
    assert len(axis.collections) == 2
    fields.draw_lines(axis, np.abs(two_balls[0]) + 1)
    assert len(axis.collections) == 2
