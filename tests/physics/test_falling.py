"""What falls, falls as fast as it should; one simulation serves for many falls."""

import numpy as np
import pytest
import torch
import trimesh

from rasp_core.geometry.containers import Container, box
from rasp_core.geometry.meshes import make_body
from rasp_core.physics import falling
from rasp_core.physics.falling import Fall
from rasp_core.poses import Poses


def cube(edge=0.1):
    mesh = trimesh.creation.box([edge] * 3)
    return make_body("cube", mesh.vertices, mesh.faces)


def at(*places):
    return Poses(torch.eye(3, dtype=torch.float64).repeat(len(places), 1, 1), torch.tensor(places, dtype=torch.float64))


def test_a_fall_is_free_until_the_floor():
    fallen = Fall([cube()], box((1.0, 1.0, 1.0))).run(at((0, 0, 0.3)), 0.2, until_rest=False)
    assert not fallen.at_rest
    assert 0.3 - fallen.poses.translation[0, 2].item() == pytest.approx(9.81 * 0.2**2 / 2, rel=0.02)


def test_one_simulation_serves_for_many_falls():
    fall = Fall([cube(), cube()], box((0.5, 0.5, 0.5)))
    first = fall.run(at((0, 0, -0.1), (0, 0, 0.15)), 3)
    fall.run(at((0.1, 0.1, 0), (-0.1, 0, 0.15)), 0.5)
    again = fall.run(at((0, 0, -0.1), (0, 0, 0.15)), 3)
    assert first.at_rest
    assert first.simulated < 3
    assert torch.equal(first.poses.translation, again.poses.translation)
    assert first.poses.translation[:, 2].tolist() == pytest.approx([-0.2, -0.1], abs=1e-3)


def test_a_fine_container_gets_coarser_walls():
    ball = trimesh.creation.icosphere(radius=0.2, subdivisions=5)
    slabs = falling._slabs(Container(make_body("bowl", ball.vertices, ball.faces)))
    assert len(slabs) <= falling.SIMULATION.most_wall_faces
    inner = np.array([np.linalg.norm(slab[:3], axis=1).max() for slab in slabs])
    assert inner == pytest.approx(0.2, abs=0.01)
