"""Files -> bodies: their parts, units, names; nothing is lost or misread in silence."""

import unicodedata
import warnings

import numpy as np
import pytest
import trimesh

from rasp_core.geometry.loading import MESH_SUFFIXES, METRES, Reading, load_bodies, load_body, load_parts
from rasp_core.geometry.shells import is_closed
from rasp_core.util.errors import InputError, MeshError, MeshWarning

CUBE = trimesh.creation.box((1, 2, 3))


def save(path, mesh=CUBE):
    trimesh.Scene([mesh]).export(path) if path.suffix == ".3mf" else mesh.export(path)
    return path


def plate(path, *volumes):
    """A file of cubes side by side, each a part."""
    scene = trimesh.Scene()
    for k, volume in enumerate(volumes):
        cube = trimesh.creation.box((volume ** (1 / 3),) * 3)
        pose = trimesh.transformations.translation_matrix((5 * k, 0, 0))
        scene.add_geometry(cube, node_name=f"part {k}", geom_name=f"part {k}", transform=pose)
    scene.export(path)
    return path


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_every_format_is_read(tmp_path, suffix):
    metres = 1e-3 if suffix == ".3mf" else 1.0
    body = load_body(save(tmp_path / f"box{suffix}"))
    assert (body.name, body.volume) == ("box", pytest.approx(6 * metres**3, rel=1e-5))
    assert body.source == str(tmp_path / f"box{suffix}")


@pytest.mark.parametrize(("unit", "metres"), [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0), ("inch", 0.0254)])
def test_the_unit_counts_where_the_file_states_none(tmp_path, unit, metres):
    reading = Reading(unit=unit)
    assert reading.metres == metres
    assert load_body(save(tmp_path / "a.stl"), reading).volume == pytest.approx(6 * metres**3)
    assert load_body(save(tmp_path / "a.glb"), reading).volume == pytest.approx(6)
    assert load_body(save(tmp_path / "a.3mf"), reading).volume == pytest.approx(6e-9)


@pytest.mark.parametrize("suffix", [".glb", ".3mf"])
def test_parts_of_a_file_are_bodies_of_their_own(tmp_path, suffix):
    path = plate(tmp_path / f"plate{suffix}", 1, 8, 27)
    metres = 1e-3 if suffix == ".3mf" else 1.0
    parts = load_parts(path)
    assert sorted(part.volume for part in parts) == pytest.approx([v * metres**3 for v in (1, 8, 27)], rel=1e-5)
    assert len({part.name for part in parts}) == 3
    assert all(part.name.startswith("plate.") for part in parts)
    (whole,) = load_parts(path, Reading(together=True))
    assert (whole.name, whole.volume) == ("plate", pytest.approx(36 * metres**3, rel=1e-5))


def test_parts_that_overlap_are_united_when_they_are_kept_together(tmp_path):
    scene = trimesh.Scene([CUBE, CUBE.copy().apply_translation((0.5, 0, 0))])
    scene.export(tmp_path / "two.glb")
    assert load_body(tmp_path / "two.glb").volume == pytest.approx(9)
    assert sum(part.volume for part in load_parts(tmp_path / "two.glb")) == pytest.approx(12)


def test_parts_that_are_closed_only_together_are_one(tmp_path):
    up = CUBE.face_normals[:, 2] > 0.5
    scene = trimesh.Scene([CUBE.submesh([np.flatnonzero(up)])[0], CUBE.submesh([np.flatnonzero(~up)])[0]])
    scene.export(tmp_path / "halves.glb")
    with pytest.warns(MeshWarning, match="2 parts that are open alone are closed together"):
        (body,) = load_parts(tmp_path / "halves.glb")
    assert (body.name, body.volume) == ("halves", pytest.approx(6))


def test_loose_pieces_are_parted_on_request(tmp_path):
    pieces = trimesh.util.concatenate([CUBE, CUBE.copy().apply_translation((9, 0, 0))])
    save(tmp_path / "two.stl", pieces)
    assert [body.volume for body in load_parts(tmp_path / "two.stl")] == pytest.approx([12])
    split = load_parts(tmp_path / "two.stl", Reading(split=True))
    assert [body.volume for body in split] == pytest.approx([6, 6])
    assert [body.name for body in split] == ["two.1", "two.2"]
    assert sorted(body.centre[0] for body in split) == pytest.approx([0, 9])


def test_what_was_done_is_said_and_kept(tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=3)
    ball.update_faces(np.arange(len(ball.faces)) > 0)
    save(tmp_path / "ball.stl", ball)
    with pytest.warns(MeshWarning, match=r"ball\.stl: 1 hole closed") as told:
        body = load_body(tmp_path / "ball.stl")
    assert len(told) == 1
    assert body.notes[0].startswith("1 hole closed")
    with pytest.raises(MeshError, match=r"ball\.stl: .*3 open edges in 1 hole"):
        load_body(tmp_path / "ball.stl", Reading(repair="none"))
    half = ball.submesh([np.flatnonzero(ball.triangles_center[:, 2] > 0)])[0]
    with pytest.warns(MeshWarning, match="wrapped on a grid"):
        wrapped = load_body(save(tmp_path / "half.stl", half), Reading(repair="wrap"))
    assert wrapped.volume == pytest.approx(ball.volume / 2, rel=0.15)


def test_a_clean_file_is_read_without_a_word(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert load_body(save(tmp_path / "a.stl")).notes == ()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ({"unit": "yard"}, "unit must be one of mm, cm, m, inch"),
        ({"repair": "all"}, "repair must be one of none, close, wrap"),
        ({"together": True, "split": True}, "give one of them"),
    ],
)
def test_readings_that_make_no_sense(words, says):
    with pytest.raises(InputError, match=says):
        Reading(**words)
    assert Reading() == METRES


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


def test_hidden_files_of_a_folder_are_not_read(tmp_path):
    save(tmp_path / "part.stl")
    (tmp_path / "._part.stl").write_bytes(b"\0\5\x16\7 no mesh")
    (tmp_path / ".hidden.stl").write_bytes(b"")
    assert [body.name for body in load_bodies([tmp_path])] == ["part"]


def test_names_that_are_hard(tmp_path):
    names = ["bolt#3", "bolt#12", "Büchse", "a b'c\"d", "-rf", "container"]
    for name in names:
        save(tmp_path / f"{name}.stl")
    (tmp_path / "x").mkdir()
    save(tmp_path / "x" / (unicodedata.normalize("NFD", "Büchse") + ".stl"))
    bodies = load_bodies([tmp_path, tmp_path / "x"])
    found = {body.source: body.name for body in bodies}
    assert [found[str(tmp_path / f"{name}.stl")] for name in names] == [
        *("bolt_3", "bolt_12", "Büchse", "a b'c\"d", "-rf", "container#2"),
    ]
    assert bodies[-1].name == "Büchse#2"


def test_equal_stems_of_two_folders_are_told_apart(tmp_path):
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        save(tmp_path / side / "part.stl")
    bodies = load_bodies([tmp_path / "left", tmp_path / "right"])
    assert [body.name for body in bodies] == ["part", "part#2"]
    assert [body.source for body in bodies] == [str(tmp_path / side / "part.stl") for side in ("left", "right")]


def test_many_files_are_read_with_a_bar(tmp_path, capsys):
    for k in range(25):
        save(tmp_path / f"{k:02}.stl")
    assert len(load_bodies([tmp_path], progress=True)) == 25
    assert "read" in capsys.readouterr().err


@pytest.mark.real_data
@pytest.mark.parametrize("group", ["kitchen", "general", "blockout", "cad", "containers"])
def test_every_real_mesh_becomes_a_solid(data, group):
    for path in sorted((data / group).iterdir()):
        body = load_body(path)
        assert is_closed(body.solid_faces), path.name
        assert body.volume > 0.3 * trimesh.Trimesh(body.vertices, body.faces, process=False).volume


@pytest.mark.real_data
def test_a_model_with_faces_of_no_area_is_read(data):
    """3DBenchy, low poly: closed only with its four triangles of no area."""
    body = load_body(data / "benchy" / "low_poly_benchy.stl")
    assert (body.volume, body.notes) == (pytest.approx(15161.36, rel=1e-5), ())


def test_objects_of_an_obj_that_lie_close_are_one_thing(tmp_path):
    """Decompositions into convex pieces are written so, with gaps between the pieces."""

    def save_objects(name, *places):
        text, first = "", 1
        for k, x in enumerate(places):
            text += f"o piece_{k}\n" + "".join(f"v {a + x} {b} {c}\n" for a, b, c in CUBE.vertices)
            text += "".join("f {} {} {}\n".format(*(face + first)) for face in CUBE.faces)
            first += 8
        (tmp_path / name).write_text(text)
        return tmp_path / name

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        (close,) = load_parts(save_objects("close.obj", 0, 1.01, 2.02))
    assert (close.name, close.volume) == ("close", pytest.approx(18))
    apart = load_parts(save_objects("apart.obj", 0, 1.01, 4))
    assert [(body.name, round(body.volume, 6)) for body in apart] == [("apart.piece_0", 12), ("apart.piece_2", 6)]


def test_pieces_that_lie_apart_in_one_part_are_told(tmp_path):
    save(tmp_path / "two.ply", trimesh.util.concatenate([CUBE, CUBE.copy().apply_translation((9, 0, 0))]))
    with pytest.warns(
        MeshWarning, match=r"two\.ply: 2 pieces that lie apart are kept as one object; --split parts them"
    ):
        (body,) = load_parts(tmp_path / "two.ply")
    assert body.volume == pytest.approx(12)
