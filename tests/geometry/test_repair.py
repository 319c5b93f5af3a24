"""Surfaces with the slips of exports, mended; each with the volume that its author meant."""

import numpy as np
import pytest
import trimesh

from rasp_core.geometry.repair import repair
from rasp_core.geometry.shells import is_closed
from rasp_core.util.errors import MeshError

CUBE = trimesh.creation.box((1, 2, 3))
BALL = trimesh.creation.icosphere(subdivisions=3)


def soup(mesh):
    return mesh.triangles.reshape(-1, 3).copy(), np.arange(3 * len(mesh.faces)).reshape(-1, 3)


def mended(vertices, faces, how="close"):
    made = repair(np.asarray(vertices, float), np.asarray(faces), how)
    assert is_closed(made.faces)
    return made


def test_a_soup_of_equal_corners_is_welded_without_a_word():
    made = mended(*soup(CUBE))
    assert (made.solid.volume(), made.notes, len(made.vertices)) == (pytest.approx(6), (), 8)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_corners_that_differ_by_rounding_are_merged(scale):
    vertices, faces = soup(BALL)
    vertices += np.random.default_rng(0).normal(size=vertices.shape) * 1e-6
    made = mended(vertices * scale, faces)
    assert made.solid.volume() == pytest.approx(BALL.volume * scale**3, rel=1e-4)
    (note,) = made.notes
    assert "differ by rounding" in note


def test_repeated_faces_and_faces_without_area():
    faces = np.concatenate([CUBE.faces, CUBE.faces[:5], [[0, 0, 1], [2, 2, 2]]])
    made = mended(CUBE.vertices, faces)
    assert made.solid.volume() == pytest.approx(6)
    assert made.notes == ("5 repeated faces dropped",)


def test_faces_of_no_area_that_hold_a_surface_together_are_kept():
    """A vertex in the middle of an edge, and the flat face that joins it to the edge: closed as it is."""
    faces, vertices = np.asarray(CUBE.faces), np.asarray(CUBE.vertices)
    a, b, c = faces[0]
    vertices = np.concatenate([vertices, [(vertices[a] + vertices[b]) / 2]])
    split = np.concatenate([faces[1:], [[a, 8, c], [8, b, c], [a, b, 8]]])
    assert mended(vertices, split).notes == ()
    assert mended(*soup(trimesh.Trimesh(vertices, split, process=False))).notes == ()


def test_faces_wound_the_other_way():
    faces = np.asarray(BALL.faces).copy()
    faces[::7] = faces[::7, ::-1]
    made = mended(BALL.vertices, faces)
    assert made.solid.volume() == pytest.approx(BALL.volume)
    assert "wound the other way" in made.notes[-1]


def test_a_t_junction_is_split():
    faces, vertices = np.asarray(CUBE.faces), np.asarray(CUBE.vertices)
    a, b, c = faces[0]
    vertices = np.concatenate([vertices, [0.3 * vertices[a] + 0.7 * vertices[b]]])
    made = mended(vertices, np.concatenate([faces[1:], [[a, 8, c], [8, b, c]]]))
    assert made.solid.volume() == pytest.approx(6)
    assert made.notes == ("1 edges split at corners that lie on them",)


def test_faces_back_to_back_bound_nothing():
    ball = np.asarray(BALL.faces)
    vertices = np.concatenate([BALL.vertices, [[3, 0, 0], [4, 0, 0], [3, 1, 0]]])
    flap = np.array([[642, 643, 644], [643, 642, 644]])
    made = mended(vertices, np.concatenate([ball, flap]))
    assert made.solid.volume() == pytest.approx(BALL.volume)
    assert made.notes == ("2 faces back to back dropped",)
    with pytest.raises(MeshError, match="back to back"):
        repair(vertices, flap)


def test_a_small_hole_is_closed_and_told():
    made = mended(BALL.vertices, BALL.faces[1:])
    assert made.solid.volume() == pytest.approx(BALL.volume, rel=1e-2)
    (note,) = made.notes
    assert note.startswith("1 hole closed, the longest ")
    with pytest.raises(MeshError, match=r"3 open edges in 1 hole, .*--repair close"):
        repair(BALL.vertices, BALL.faces[1:], "none")


def test_a_large_hole_is_refused_with_its_place():
    open_box = CUBE.faces[~(CUBE.face_normals[:, 2] > 0.9)]
    with pytest.raises(MeshError, match=r"4 open edges in 1 hole, the largest 6 m around, near \(0, 0, 1\.5\)"):
        repair(np.asarray(CUBE.vertices), open_box)


def test_no_shell_is_left_out():
    """A ball beside a sheet: neither the ball alone nor the sheet."""
    vertices = np.concatenate([BALL.vertices, [[9, 0, 0], [10, 0, 0], [9, 1, 0], [9.3, 1, 5]]])
    sheet = np.array([[642, 643, 644], [643, 645, 644]])
    with pytest.raises(MeshError, match="4 open edges in 1 hole"):
        repair(vertices, np.concatenate([BALL.faces, sheet]))


def test_a_scrap_is_left_out_and_told():
    scrap = np.array([[3, 0, 0], [3.01, 0, 0], [3, 0.01, 0]])
    made = mended(np.concatenate([BALL.vertices, scrap]), np.concatenate([BALL.faces, [[642, 643, 644]]]))
    assert made.solid.volume() == pytest.approx(BALL.volume)
    assert made.notes[0].startswith("1 loose scraps dropped")


def test_a_surface_that_cannot_be_wound_is_refused():
    """A Moebius strip has one side."""
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    rows = [
        [((1 + s * np.cos(a / 2)) * np.cos(a), (1 + s * np.cos(a / 2)) * np.sin(a), s * np.sin(a / 2)) for a in angle]
        for s in (-0.3, 0.3)
    ]
    vertices = np.array(rows).reshape(-1, 3)
    faces = []
    for k in range(24):
        a, b = k, (k + 1) % 24
        c, d = (24 + k, 24 + (k + 1) % 24)
        if k == 23:
            b, d = d, b
        faces += [(a, b, d), (a, d, c)]
    with pytest.raises(MeshError, match="open"):
        repair(vertices, np.array(faces))
