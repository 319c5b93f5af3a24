"""Winding numbers beside what they are."""

import numpy as np
import pytest
import trimesh

from rasp_core.kernels.winding import winding_numbers


@pytest.mark.parametrize("times", [1, 2])
def test_a_surface_goes_round_its_inside(times):
    ball = trimesh.creation.icosphere(3, 0.5)
    faces = np.tile(np.asarray(ball.faces), (times, 1))
    points = np.array([[0.0, 0, 0], [0.1, 0.2, 0.3], [0.6, 0, 0]])
    assert winding_numbers(np.asarray(ball.vertices), faces, points) == pytest.approx([times, times, 0], abs=1e-9)


def test_inside_out_it_goes_the_other_way():
    block = trimesh.creation.box((1.0, 2.0, 3.0))
    faces = np.ascontiguousarray(np.asarray(block.faces)[:, ::-1])
    assert winding_numbers(np.asarray(block.vertices), faces, np.zeros((1, 3))) == pytest.approx([-1])
