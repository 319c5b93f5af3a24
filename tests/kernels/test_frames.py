"""Rotations by nine numbers against numpy's matrices."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rasp_core.kernels import frames

R, Q = Rotation.random(2, random_state=np.random.RandomState(0)).as_matrix()
V = np.array([0.3, -1.2, 2.0])


@pytest.fixture
def pair():
    both = np.stack([R, Q])
    return frames.matrix(both, 0), frames.matrix(both, 1)


def test_directions_are_turned_to_the_world_and_back(pair):
    assert frames.rotate(pair[0], *V) == pytest.approx(R @ V)
    assert frames.rotate_back(pair[0], *V) == pytest.approx(R.T @ V)


def test_the_rotation_between_two_frames(pair):
    assert np.reshape(frames.relative(*pair), (3, 3)) == pytest.approx(R.T @ Q)


def test_a_wrench_is_a_force_and_its_moments():
    sums, point, force = np.ones(13), V, np.array([2.0, 0.5, -1])
    frames.add_wrench(sums, 7.0, *point, *force)
    assert sums == pytest.approx(1 + np.concatenate([[7], force, np.outer(point, force).ravel()]))
