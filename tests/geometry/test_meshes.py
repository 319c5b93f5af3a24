"""Bodies from real and from broken meshes."""

import subprocess
import sys

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from rasp_core.geometry.growing import grown
from rasp_core.geometry.meshes import Body, body_of_solid, make_body, unique_names
from rasp_core.geometry.shells import is_closed
from rasp_core.util.errors import MeshError

CUBE = trimesh.creation.box((1, 2, 3))


def moved(mesh, shift):
    return np.asarray(mesh.vertices) + shift, np.asarray(mesh.faces)


def joined(*parts):
    vertices, faces, at = [], [], 0
    for v, f in parts:
        vertices.append(v)
        faces.append(f + at)
        at += len(v)
    return np.concatenate(vertices), np.concatenate(faces)


def test_a_box_keeps_its_volume_and_is_centred():
    body = make_body("box", *moved(CUBE, (5, 6, 7)))
    assert body.volume == pytest.approx(6)
    assert body.centre == pytest.approx([5, 6, 7])
    assert body.half_extents == pytest.approx([0.5, 1, 1.5])
    assert body.radius == pytest.approx(np.linalg.norm([0.5, 1, 1.5]))


def test_overlapping_pieces_are_united():
    body = make_body("two", *joined(moved(CUBE, 0), moved(CUBE, (0.5, 0, 0))))
    assert body.volume == pytest.approx(9)
    assert len(body.vertices) == 16, "the surface itself stays as given"


def test_an_inverted_piece_within_is_a_cavity():
    inner = trimesh.creation.box((0.5, 1, 1))
    body = make_body("hollow", *joined(moved(CUBE, 0), (inner.vertices, inner.faces[:, ::-1])))
    assert body.volume == pytest.approx(6 - 0.5)


def test_a_surface_that_is_inside_out_is_turned():
    assert make_body("inverted", CUBE.vertices, CUBE.faces[:, ::-1]).volume == pytest.approx(6)


def test_an_stl_without_shared_vertices_is_welded():
    soup = CUBE.triangles.reshape(-1, 3)
    assert not is_closed(np.arange(36).reshape(-1, 3))
    assert make_body("soup", soup, np.arange(36).reshape(-1, 3)).volume == pytest.approx(6)


def test_a_small_hole_is_filled():
    ball = trimesh.creation.icosphere(subdivisions=3)
    assert make_body("holed", ball.vertices, ball.faces[1:]).volume == pytest.approx(ball.volume, rel=1e-2)


@pytest.mark.parametrize(
    ("vertices", "faces", "says"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3)), "no triangles"),
        (np.eye(3), [[0, 1, 3]], "not there"),
        (np.array([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]]), [[0, 1, 2]], "NaN"),
        (np.ones((3, 3)), [[0, 1, 2]], "one point"),
        (np.eye(3), [[0, 1, 2]], "open"),
        (CUBE.vertices * [1, 1, 0], CUBE.faces, "no volume"),
    ],
)
def test_what_bounds_no_solid_is_refused(vertices, faces, says):
    with pytest.raises(MeshError, match=f"thing: .*{says}"):
        make_body("thing", vertices, faces)


def test_rows_that_are_no_triangles_are_refused():
    for vertices, faces in ((np.zeros((4, 4)), CUBE.faces), (CUBE.vertices, np.zeros((2, 4), int))):
        with pytest.raises(MeshError, match="three numbers each"):
            make_body("box", vertices, faces)


def test_bodies_of_one_name_are_numbered():
    box = make_body("box", CUBE.vertices, CUBE.faces)
    names = [body.name for body in unique_names([box, box, box])]
    assert names == ["box", "box#2", "box#3"]


def test_names_that_a_scene_keeps_are_numbered_from_two():
    bodies = [make_body(name, CUBE.vertices, CUBE.faces) for name in ("container", "world", "camera", "container")]
    assert [body.name for body in unique_names(bodies)] == ["container#2", "world#2", "camera#2", "container#3"]


def test_a_body_of_a_solid_has_its_surface():
    body = make_body("box", *moved(CUBE, (5, 6, 7)))
    half = body_of_solid(body, body.manifold.translate(body.centre).trim_by_plane((0, 0, 1), 7.0), ["halved"])
    assert (half.volume, half.notes) == (pytest.approx(3), ("halved",))
    assert half.vertices[:, 2].min() == pytest.approx(7)
    with pytest.raises(MeshError, match="box: encloses no volume"):
        body_of_solid(body, body.manifold.trim_by_plane((0, 0, 1), 9.0), [])


@given(st.floats(1e-3, 1e3))
def test_scaling_scales_lengths(factor):
    body = make_body("box", *moved(CUBE, (1, 0, 0))).scaled(factor)
    assert body.volume == pytest.approx(6 * factor**3)
    assert body.centre == pytest.approx([factor, 0, 0])
    assert body.manifold.volume() == pytest.approx(6 * factor**3, rel=1e-5)


def test_the_hull_of_a_dented_block_has_its_corners():
    block, dent = trimesh.creation.box((2, 2, 2)), trimesh.creation.box((1, 1, 1)).apply_translation((3, 3, 4))
    dented = trimesh.boolean.difference([block.apply_translation((3, 3, 3)), dent], engine="manifold")
    body = make_body("dented", dented.vertices, dented.faces)
    assert sorted(map(tuple, body.hull_corners.round(9))) == sorted(
        map(tuple, trimesh.creation.box((2, 2, 2)).vertices)
    )


def test_equal_bodies_have_equal_digests():
    first, second = (make_body(name, CUBE.vertices, CUBE.faces) for name in "ab")
    assert isinstance(first, Body)
    assert first.digest == second.digest
    assert first.digest != first.scaled(2).digest


@pytest.mark.real_data
def test_kitchen_volumes_are_those_of_their_pieces(kitchen):
    """The pieces touch and do not overlap: summed over the pieces, signed tetrahedra give the union's volume."""
    for body in kitchen:
        a, b, c = (body.vertices[body.faces[:, k]] for k in range(3))
        pieces = (a * np.cross(b, c)).sum() / 6
        assert body.volume == pytest.approx(pieces, rel=2e-4)


def test_a_body_keeps_arrays_of_its_own():
    vertices = CUBE.vertices.copy()
    body = make_body("box", vertices, CUBE.faces)
    vertices[:] = 0
    assert np.ptp(body.vertices, axis=0) == pytest.approx([1, 2, 3])


def test_bodies_that_outlive_the_program_are_not_reported_as_leaks():
    code = (
        "import ctypes; from data_fetch import kitchen_like; bodies = kitchen_like(2); "
        "print(bodies[0].manifold.volume() > 0); ctypes.pythonapi.Py_IncRef(ctypes.py_object(bodies))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("True\n", "")


def test_a_body_that_is_moved_is_so_with_what_it_was_grown_from():
    shift, body = np.array([1.0, 2, 3]), grown(make_body("cube", *moved(CUBE, (0, 0, 0))), 0.1)
    after_all = body.moved(shift)
    for before, after in ((body, after_all), (body.core, after_all.core)):
        assert after.vertices == pytest.approx(before.vertices + shift)
        assert after.placed(np.eye(4)) == pytest.approx(before.placed(np.eye(4)) + shift)
    assert after_all.digest == body.digest


def test_a_simplified_body_strays_no_further_than_was_said():
    ball = trimesh.creation.icosphere(subdivisions=5)
    body = make_body("ball", ball.vertices, ball.faces)
    rough = body.simplified(0.01)
    assert len(rough.solid_faces) < 0.2 * len(body.solid_faces)
    assert (rough.volume, rough.name) == (body.volume, body.name)
    assert np.linalg.norm(rough.solid_vertices, axis=1) == pytest.approx(1, abs=0.01)
    middles = rough.solid_vertices[rough.solid_faces].mean(1)
    assert np.linalg.norm(middles, axis=1).min() > 1 - 0.02
