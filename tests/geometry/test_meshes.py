"""Bodies from real and from broken meshes."""

import subprocess
import sys

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from rasp_core.geometry.meshes import (
    Body,
    is_closed,
    load_bodies,
    load_body,
    make_body,
    to_manifold,
    unique_names,
    unite,
)
from rasp_core.util.errors import InputError, MeshError

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


def test_touching_pieces_lose_their_inner_faces():
    solid = unite(*joined(moved(CUBE, 0), moved(CUBE, (1, 0, 0))))
    assert solid.volume() == pytest.approx(12)
    assert solid.surface_area() == pytest.approx(2 * (2 * 2 + 2 * 3 + 2 * 3))


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


def test_of_several_open_pieces_the_largest_closed_one_is_kept():
    ball = trimesh.creation.icosphere(subdivisions=2)
    plane = (np.array([[9, 0, 0], [10, 0, 0], [9, 1, 0], [9.3, 1, 5]]), np.array([[0, 1, 2], [1, 3, 2]]))
    body = make_body("ball and sheet", *joined(moved(ball, 0), plane))
    assert body.volume == pytest.approx(ball.volume)


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


def test_to_manifold_refuses_an_open_surface():
    with pytest.raises(MeshError, match="not closed"):
        to_manifold(CUBE.vertices, CUBE.faces[1:])


@pytest.mark.parametrize("suffix", [".obj", ".stl", ".ply", ".off", ".glb", ".3mf"])
def test_every_format_is_read(tmp_path, suffix):
    path = tmp_path / f"box{suffix}"
    trimesh.Scene([CUBE]).export(path) if suffix == ".3mf" else CUBE.export(path)
    body = load_body(path)
    assert (body.name, body.volume) == ("box", pytest.approx(6, rel=1e-5))


def test_files_that_cannot_be_used_are_named(tmp_path):
    (tmp_path / "a.obj").write_text("not a mesh")
    (tmp_path / "b.txt").write_text("")
    (tmp_path / "c.stl").write_bytes(b"\0" * 10)
    (tmp_path / "empty").mkdir()
    for name, says in [("a.obj", "a.obj"), ("b.txt", "not a mesh file"), ("c.stl", "c.stl"), ("gone.obj", "no such")]:
        with pytest.raises(MeshError, match=says):
            load_body(tmp_path / name)
    with pytest.raises(InputError, match="no mesh files"):
        load_bodies([tmp_path / "empty"])
    with pytest.raises(InputError, match="no objects"):
        load_bodies([])


def test_rows_that_are_no_triangles_are_refused():
    for vertices, faces in ((np.zeros((4, 4)), CUBE.faces), (CUBE.vertices, np.zeros((2, 4), int))):
        with pytest.raises(MeshError, match="three numbers each"):
            make_body("box", vertices, faces)


def test_bodies_of_one_name_are_numbered():
    box = make_body("box", CUBE.vertices, CUBE.faces)
    names = [body.name for body in unique_names([box, box, box])]
    assert names == ["box", "box#2", "box#3"]


@given(st.floats(1e-3, 1e3))
def test_scaling_scales_lengths(factor):
    body = make_body("box", *moved(CUBE, (1, 0, 0))).scaled(factor)
    assert body.volume == pytest.approx(6 * factor**3)
    assert body.centre == pytest.approx([factor, 0, 0])
    assert body.manifold.volume() == pytest.approx(6 * factor**3, rel=1e-5)


def test_equal_bodies_have_equal_digests():
    first, second = (make_body(name, CUBE.vertices, CUBE.faces) for name in "ab")
    assert isinstance(first, Body)
    assert first.digest == second.digest
    assert first.digest != first.scaled(2).digest


@pytest.mark.real_data
@pytest.mark.parametrize("group", ["kitchen", "general", "blockout", "cad", "containers"])
def test_every_real_mesh_becomes_a_solid(data, group):
    for path in sorted((data / group).iterdir()):
        body = load_body(path)
        assert is_closed(body.solid_faces), path.name
        assert body.volume > 0.3 * trimesh.Trimesh(body.vertices, body.faces, process=False).volume


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
