"""Rotations against scipy's, and what the learned turns and shifts make of a start."""

from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rasp_core import poses
from rasp_core.geometry.containers import box
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.wishes import Wishes, turns_of
from rasp_core.util.adam import Adam

angles = st.lists(st.floats(-7, 7), min_size=3, max_size=3).map(lambda a: torch.tensor(a, dtype=torch.float64))


@given(angles)
def test_angles_turn_about_x_then_y_then_z(angle):
    expected = Rotation.from_euler("xyz", angle.numpy()).as_matrix()
    assert poses.angles_to_rotation(angle).numpy() == pytest.approx(expected, abs=1e-12)


@given(angles, st.floats(0.1, 10))
def test_quaternions_of_any_length_are_scalar_first(angle, length):
    rotation = Rotation.from_euler("xyz", angle.numpy())
    expected, quaternion = rotation.as_matrix(), torch.from_numpy(rotation.as_quat()[[3, 0, 1, 2]])
    assert poses.quaternion_to_rotation(length * quaternion).numpy() == pytest.approx(expected, abs=1e-12)


@given(angles)
@settings(max_examples=200)
def test_rotations_survive_the_way_to_angles(angle):
    rotation = poses.angles_to_rotation(angle)
    back = poses.angles_to_rotation(poses.rotation_to_angles(rotation))
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


@given(angles)
def test_homogeneous_matrices_turn_and_then_shift(angle):
    rotation, translation, point = poses.angles_to_rotation(angle), angle + 1, angle.flip(0)
    moved = poses.to_matrix(rotation, translation) @ torch.cat([point, torch.ones(1)])
    assert torch.allclose(moved[:3], rotation @ point + translation)
    assert moved[3] == 1


@pytest.mark.parametrize("parametrisation", ["angles", "quaternion"])
def test_what_is_learned_moves_the_first_bodies_only(parametrisation):
    generator = torch.Generator().manual_seed(0)
    rotation = poses.quaternion_to_rotation(poses.random_quaternions(3, generator, torch.float64))
    start = poses.Poses(rotation, torch.randn(3, 3, generator=generator, dtype=torch.float64))
    variables = poses.Variables(start, 2, 5.0, parametrisation)
    assert torch.allclose(variables.poses()[0], rotation)
    assert torch.equal(variables.poses()[1], start.translation)
    adam = Adam(variables.parameters)
    found = variables.poses()
    (-found[1].sum() + found[0][:, 2, 1].sum() - rotation[:, 2, 1].sum()).backward()
    adam.step(variables.rates(0.01))
    turned, shifted = (x.detach() for x in variables.poses())
    assert shifted - start.translation == pytest.approx(torch.tensor([[0.05], [0.05], [0]]).expand(3, 3).numpy())
    assert torch.equal(turned[2], rotation[2])
    angle = poses.degrees_between(turned[:2], rotation[:2])
    # Adam's first step is the rate along each axis that matters
    assert (angle > 0.5).all()
    assert (angle < 1.01 * np.degrees(0.01 * np.sqrt(3))).all()


@given(st.floats(0, 180))
def test_degrees_between_two_turns(degrees):
    turned = poses.angles_to_rotation(torch.tensor([0, 0, np.radians(degrees)], dtype=torch.float64))
    assert poses.degrees_between(turned, torch.eye(3, dtype=torch.float64)).item() == pytest.approx(degrees, abs=1e-5)


@pytest.mark.parametrize("parametrisation", ["angles", "quaternion"])
def test_wished_turns_are_drawn_and_kept(parametrisation):
    mesh = trimesh.creation.box((3, 2, 1))
    body = make_body("b", mesh.vertices, mesh.faces)
    bodies = [replace(body, wishes=Wishes(turns=turns_of(word, body.manifold))) for word in ("z", "none", "any")]
    start = poses.Poses.random(bodies, box((9, 9, 9)), 3)
    assert start.rotation[0, 2].tolist() == pytest.approx([0, 0, 1])
    assert start.rotation[1].tolist() == np.eye(3).tolist()
    freedom = poses.freedom_of(bodies)
    assert freedom.tolist() == [[0, 0, 1], [0, 0, 0], [1, 1, 1]]
    assert poses.freedom_of([body]) is None
    variables = poses.Variables(start, 3, 1.0, parametrisation, torch.tensor(freedom).float())
    with torch.no_grad():
        variables.turn += 0.3
    rotation = variables.poses()[0].detach()
    assert rotation[0, 2].tolist() == pytest.approx([0, 0, 1], abs=1e-6)
    assert (rotation[0] - start.rotation[0]).abs().max() > 0.1
    assert rotation[1].numpy() == pytest.approx(np.eye(3), abs=1e-6)
    assert poses.snapped(bodies, rotation.double())[1].tolist() == np.eye(3).tolist()
