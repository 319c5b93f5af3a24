"""Which poses are the same, against turns and shifts that are known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rasp_core.assembly.scored_poses import ScoredPose, best_first, distinct, stack, unstack

HERE = ScoredPose(np.eye(3), np.zeros(3), 0.5)


@pytest.mark.parametrize(("angle", "apart"), [(0.19, False), (0.21, True)])
def test_a_turn_by_more_than_the_angle_differs(angle, apart):
    turned = ScoredPose(Rotation.from_rotvec([0.0, angle, 0.0]).as_matrix(), np.zeros(3))
    assert turned.differs(HERE, 0.2, 0.01) == HERE.differs(turned, 0.2, 0.01) == apart


@pytest.mark.parametrize(("shift", "apart"), [(0.009, False), (0.011, True)])
def test_a_shift_by_more_than_the_distance_differs(shift, apart):
    assert ScoredPose(np.eye(3), np.array([0.0, 0.0, shift])).differs(HERE, 0.2, 0.01) == apart


def test_stacked_poses_come_back_and_none_have_shapes_too():
    poses = [HERE, ScoredPose(np.diag([1.0, -1, -1]), np.ones(3), 0.25)]
    again = unstack(*stack(poses), np.array([0.5, 0.25]))
    assert [pose.score for pose in again] == [0.5, 0.25]
    assert np.array_equal(again[1].rotation, poses[1].rotation)
    assert np.array_equal(again[1].translation, poses[1].translation)
    assert [array.shape for array in stack([])] == [(0, 3, 3), (0, 3)]


def test_the_best_come_first_and_equal_ones_in_their_order():
    first, second, best = (ScoredPose(np.eye(3), np.zeros(3), score) for score in (0.1, 0.1, 0.9))
    assert [id(pose) for pose in best_first([first, second, best])] == [id(best), id(first), id(second)]


def test_of_equal_poses_the_first_is_kept():
    turn = Rotation.from_rotvec([0.0, 0.0, 0.2]).as_matrix()
    here, there = np.zeros(3), np.array([0.02, 0.0, 0.0])
    poses = [
        ScoredPose(np.eye(3), here, 0.9),
        ScoredPose(turn, here, 0.8),
        ScoredPose(np.eye(3), there, 0.7),
        ScoredPose(turn, there, 0.6),
    ]
    assert distinct(poses, 9, 0.1, 0.01) == poses
    assert distinct(poses, 9, 0.3, 0.01) == [poses[0], poses[2]]
    assert distinct(poses, 9, 0.3, 0.05) == poses[:1]
    assert distinct(poses, 2, 0.1, 0.01) == poses[:2]
    assert distinct([], 2, 0.1, 0.01) == []
