"""Placed solids, and distances to walls, against arithmetic."""

import numpy as np
import pytest
import trimesh

from rasp_core.exact.placing import core_inside, cores_apart, distance_to_wall, placed_solid
from rasp_core.geometry.containers import Container, box
from rasp_core.geometry.growing import grown
from rasp_core.geometry.meshes import make_body


def cube(name="cube"):
    mesh = trimesh.creation.box((1, 1, 1)).apply_translation((5, 0, 0))
    return make_body(name, mesh.vertices, mesh.faces)


def at(*place):
    """Where the cube, 5 along x in its file, has its centre."""
    matrix = np.eye(4)
    matrix[:3, 3] = np.array(place) - (5, 0, 0)
    return matrix


def test_a_solid_lies_where_its_file_s_vertices_go():
    low, high = np.array(placed_solid(cube(), at(1, 2, 3)).bounding_box()).reshape(2, 3)
    assert low.tolist() == [0.5, 1.5, 2.5]
    assert high.tolist() == [1.5, 2.5, 3.5]


@pytest.mark.parametrize("kind", ["box", "mesh"])
def test_the_distance_to_the_wall_is_that_of_the_nearest_face(kind):
    room = box((4, 5, 6))
    room = room if kind == "box" else Container(room.body)
    distance = distance_to_wall(room)
    assert distance(placed_solid(cube(), at(0.5, 0, 0)), 9.0) == pytest.approx(1.0)
    assert distance(placed_solid(cube(), at(0.5, 0, 0)), 0.25) == 0.25
    assert distance(placed_solid(cube(), at(1.6, 0, 0)), 9.0) == 0


def test_what_is_inside_grown_bodies_decides_how_near_they_are():
    bodies, room = [grown(cube(name), 0.1) for name in "ab"], box((4, 1.2, 1.2))
    assert cores_apart(bodies, np.array([at(0, 0, 0), at(1.2, 0, 0)]), 0, 1, -1e-9)
    assert not cores_apart(bodies, np.array([at(0, 0, 0), at(1.2, 0, 0)]), 0, 1, 1e-6)
    assert core_inside(bodies[0], at(1.4, 0, 0), room, -1e-9)
    assert not core_inside(bodies[0], at(1.4 + 1e-6, 0, 0), room, -1e-9)
