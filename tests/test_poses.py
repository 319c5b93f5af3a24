"""Rotations against scipy's, and the group's laws."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rasp_core import poses

angles = st.lists(st.floats(-7, 7), min_size=3, max_size=3).map(lambda a: torch.tensor(a, dtype=torch.float64))


@given(angles)
def test_angles_turn_about_x_then_y_then_z(angle):
    expected = Rotation.from_euler("xyz", angle.numpy()).as_matrix()
    assert poses.angles_to_rotation(angle).numpy() == pytest.approx(expected, abs=1e-12)


@given(angles, st.floats(0.1, 10))
def test_quaternions_of_any_length_are_scalar_first(angle, length):
    quaternion = poses.angles_to_quaternion(angle)
    expected = Rotation.from_quat(quaternion.numpy()[[1, 2, 3, 0]]).as_matrix()
    assert poses.quaternion_to_rotation(length * quaternion).numpy() == pytest.approx(expected, abs=1e-12)


@given(angles)
@settings(max_examples=200)
def test_rotations_survive_the_way_to_angles_and_quaternions(angle):
    rotation = poses.angles_to_rotation(angle)
    for back in (
        poses.angles_to_rotation(poses.rotation_to_angles(rotation)),
        poses.quaternion_to_rotation(poses.rotation_to_quaternion(rotation)),
    ):
        assert poses.degrees_between(back, rotation).item() < 0.05


@pytest.mark.parametrize("y", [np.pi / 2, -np.pi / 2])
def test_gimbal_lock_gives_the_rotation_back(y):
    rotation = poses.angles_to_rotation(torch.tensor([0.4, y, 1.1], dtype=torch.float64))
    again = poses.angles_to_rotation(poses.rotation_to_angles(rotation))
    assert again.numpy() == pytest.approx(rotation.numpy(), abs=1e-6)


def test_random_quaternions_are_uniform_and_seeded():
    draw = [poses.random_quaternions(20_000, torch.Generator().manual_seed(3), torch.float64) for _ in range(2)]
    assert torch.equal(*draw)
    # uniform rotations send an axis anywhere with equal chance: mean 0, each coordinate's mean square 1/3
    axis = poses.quaternion_to_rotation(draw[0])[:, :, 2]
    assert axis.mean(0).abs().max() < 0.02
    assert (axis.square().mean(0) - 1 / 3).abs().max() < 0.02


@given(angles, angles)
def test_matrices_compose_and_invert(first, second):
    a = poses.to_matrix(poses.angles_to_rotation(first), second)
    b = poses.to_matrix(poses.angles_to_rotation(second), first)
    point = torch.tensor([1.0, 2, 3, 1], dtype=torch.float64)
    assert torch.allclose(poses.compose(a, b) @ point, a @ (b @ point))
    assert torch.allclose(poses.compose(poses.invert(a), a), torch.eye(4, dtype=torch.float64), atol=1e-12)
    rotation, translation = poses.from_matrix(a)
    assert torch.equal(poses.to_matrix(rotation, translation), a)


@given(st.floats(0, 180))
def test_degrees_between_two_turns(degrees):
    turned = poses.angles_to_rotation(torch.tensor([0, 0, np.radians(degrees)], dtype=torch.float64))
    assert poses.degrees_between(turned, torch.eye(3, dtype=torch.float64)).item() == pytest.approx(degrees, abs=1e-5)
