"""What falls, falls by as much as it should, and rests without overlap."""

import numpy as np
import pytest
import trimesh

from rasp_core.geometry.containers import Container, box
from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.physics import gravity
from rasp_core.util.errors import InputError


def cubes(count, edge=0.1):
    mesh = trimesh.creation.box([edge] * 3)
    return unique_names([make_body("cube", mesh.vertices, mesh.faces)] * count)


def at(*places):
    matrices = np.tile(np.eye(4), (len(places), 1, 1))
    matrices[:, :3, 3] = np.reshape(places, (-1, 3))
    return matrices


@pytest.mark.parametrize("unit", [1.0, 1000.0])
def test_a_cube_falls_to_the_floor_whatever_the_unit(unit):
    settled = gravity.settle(cubes(1, 0.1 * unit), at((0, 0, 0.05 * unit)), box([0.4 * unit] * 3))
    assert settled.at_rest
    assert settled.certificate.holds
    assert settled.matrices[0, 2, 3] == pytest.approx(-0.15 * unit, abs=0.002 * unit)
    assert settled.moved[0] == pytest.approx(0.2 * unit, abs=0.002 * unit)
    assert "certified" in settled.lines()[0]
    assert settled.to_dict()["moved_max"] == settled.moved.max()


def test_a_stack_stands():
    settled = gravity.settle(cubes(3), at((0, 0, -0.1), (0, 0, 0.0), (0, 0, 0.1)), box((0.3, 0.3, 0.3)))
    assert settled.moved.max() < 2e-3
    assert settled.turned_deg.max() < 1
    assert settled.certificate.holds


def test_what_cannot_rest_without_overlap_is_named():
    settled = gravity.settle(cubes(2), at((0, 0, 0), (0.02, 0, 0)), box((0.11, 0.11, 0.11)), seconds=0.1)
    assert not settled.certificate.holds
    assert any("cube and cube#2 overlap" in line or "sticks out" in line for line in settled.lines())


def test_a_mesh_container_holds_what_falls_in_it():
    ball = trimesh.creation.icosphere(radius=0.2, subdivisions=4)
    room = Container(make_body("bowl", ball.vertices, ball.faces))
    settled = gravity.settle(cubes(1, 0.06), at((0, 0, 0)), room)
    assert settled.certificate.protrusion_volume < 1e-3 * 0.06**3
    assert -0.2 < settled.matrices[0, 2, 3] < -0.1


def test_bad_input_is_refused():
    with pytest.raises(InputError, match="nothing to settle"):
        gravity.settle([], at(), box((1, 1, 1)))
    with pytest.raises(InputError, match="seconds must be positive"):
        gravity.settle(cubes(1), at((0, 0, 0)), box((1, 1, 1)), seconds=0)
