"""Holes, found and closed, against lids of known area."""

import numpy as np
import pytest
import trimesh

from rasp_core.geometry.holes import find_holes, lid
from rasp_core.geometry.shells import is_closed


def tube(sides, radius=1.0):
    """A prism's wall without lids: two holes of `sides` corners."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1)
    vertices = np.concatenate([np.c_[ring, np.zeros(sides)], np.c_[ring, np.ones(sides)]])
    a, b = np.arange(sides), (np.arange(sides) + 1) % sides
    return vertices, np.concatenate([np.stack([a, b, b + sides], 1), np.stack([a, b + sides, a + sides], 1)])


@pytest.mark.parametrize("sides", [3, 4, 9, 400])
def test_the_lids_of_a_tube(sides):
    vertices, faces = tube(sides)
    holes = find_holes(vertices, faces)
    assert [len(hole.corners) for hole in holes] == [sides, sides]
    assert holes[0].length == pytest.approx(2 * sides * np.sin(np.pi / sides))
    assert sorted(hole.centre[2] for hole in holes) == pytest.approx([0, 1])
    closed = np.concatenate([faces, *(lid(vertices, hole) for hole in holes)])
    assert is_closed(closed)
    area = sides / 2 * np.sin(2 * np.pi / sides)
    assert trimesh.Trimesh(vertices, closed, process=False).volume == pytest.approx(area)


def test_a_hole_that_is_not_flat_gets_the_least_lid():
    ball = trimesh.creation.icosphere(subdivisions=2)
    kept = np.asarray(ball.faces)[~((ball.triangles_center[:, 0] > 0.3) & (ball.triangles_center[:, 2] > -0.2))]
    (hole,) = find_holes(ball.vertices, kept)
    faces = lid(np.asarray(ball.vertices), hole)
    assert is_closed(np.concatenate([kept, faces]))
    area = trimesh.Trimesh(ball.vertices, faces, process=False).area
    fan = np.array([(hole.corners[0], hole.corners[k], hole.corners[k + 1]) for k in range(1, len(hole.corners) - 1)])
    assert area < trimesh.Trimesh(ball.vertices, fan, process=False).area


def test_two_holes_that_touch_at_a_corner_are_two():
    side = np.arange(5)
    grid = np.stack([np.repeat(side, 5), np.tile(side, 5), 0 * np.arange(25)], 1).astype(float)
    squares = [(5 * i + j, 5 * i + 5 + j, 5 * i + 6 + j, 5 * i + 1 + j) for i in range(4) for j in range(4)]
    left = [square for k, square in enumerate(squares) if k not in (5, 10)]
    faces = np.array([face for a, b, c, d in left for face in ((a, b, c), (a, c, d))])
    assert sorted(len(hole.corners) for hole in find_holes(grid, faces)) == [4, 4, 16]


def test_nothing_is_open():
    mesh = trimesh.creation.box()
    assert find_holes(mesh.vertices, np.asarray(mesh.faces)) == []
