"""Wrapped surfaces against the solids that they were cut from."""

import re

import numpy as np
import pytest
import trimesh

from rasp_core.geometry.shells import is_closed
from rasp_core.geometry.wrapping import CELLS, wrap


def test_a_ball_with_a_large_hole_is_closed_again():
    ball = trimesh.creation.icosphere(subdivisions=3)
    faces = ball.faces[ball.triangles_center[:, 2] < 0.8]
    vertices, closed, note = wrap(np.asarray(ball.vertices), np.asarray(faces))
    assert is_closed(closed)
    assert trimesh.Trimesh(vertices, closed, process=False).volume == pytest.approx(ball.volume, rel=0.1)
    assert note.startswith("wrapped on a grid of 0.0")


def test_a_soup_of_crossing_balls_is_one_solid():
    balls = [trimesh.creation.icosphere(subdivisions=3).apply_translation((x, 0, 0)) for x in (0, 1)]
    mesh = trimesh.util.concatenate(balls)
    faces = np.asarray(mesh.faces).copy()
    vertices, closed, _ = wrap(np.asarray(mesh.vertices), faces)
    union = 2 * 4 / 3 * np.pi - np.pi / 12 * (4 + 1) * (2 - 1) ** 2  # less the lens
    assert trimesh.Trimesh(vertices, closed, process=False).volume == pytest.approx(union, rel=0.03)


def test_a_sheet_becomes_a_plate_and_inward_faces_do_not_matter():
    sheet = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    vertices, closed, note = wrap(sheet, np.array([[0, 1, 2], [0, 2, 3]]))
    made = trimesh.Trimesh(vertices, closed, process=False)
    assert is_closed(closed)
    assert 1 / CELLS < made.volume < 5 / CELLS
    assert "100% of it as plates" in note
    assert float(re.search(r"strays ([\d.e-]+) from", note)[1]) < 3 / CELLS, "no corner of the plate is near its middle"
    ball = trimesh.creation.icosphere(subdivisions=2)
    vertices, closed, _ = wrap(np.asarray(ball.vertices), np.asarray(ball.faces)[1:, ::-1])
    assert trimesh.Trimesh(vertices, closed, process=False).volume == pytest.approx(ball.volume, rel=0.03)
