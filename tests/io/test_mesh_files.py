"""Hostile mesh files are refused in time and memory in proportion to their bytes, and never reach for other files."""

import io
import itertools
import json
import pickle
import struct
import zipfile

import numpy as np
import pytest
import trimesh

from rasp_core.io import bounds, mesh_files
from rasp_core.util.errors import MeshError

NAMESPACE = 'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"'
CORNERS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
TETRAHEDRON = (
    "<mesh><vertices>"
    + "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in CORNERS)
    + "</vertices><triangles>"
    + "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in FACES)
    + "</triangles></mesh>"
)
SOLID = f'<object id="1">{TETRAHEDRON}</object>'
HEADER = (
    "ply\nformat {} 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
)


def glb(tree: dict, data: bytes = b"") -> bytes:
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data if data else b""
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def cube(**changes) -> bytes:
    """The GLB of a cube with some entries of its JSON replaced."""
    data = trimesh.creation.box().export(file_type="glb")
    length = struct.unpack("<I", data[12:16])[0]
    return glb({**json.loads(data[20 : 20 + length]), **changes}, data[28 + length :])


def threemf(objects: str, items: str, **others: bytes) -> bytes:
    model = f"<model {NAMESPACE}><resources>{objects}</resources><build>{items}</build></model>"
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in {"3D/3dmodel.model": model, **others}.items():
            file.writestr(name, data)
    return archive.getvalue()


def doubling(levels: int) -> str:
    twice = '<object id="{0}"><components><component objectid="{1}"/><component objectid="{1}"/></components></object>'
    return SOLID + "".join(twice.format(k, k - 1) for k in range(2, levels + 2))


def entities() -> bytes:
    letters = "abcdefghij"
    names = "".join(f'<!ENTITY {later} "{f"&{earlier};" * 10}">' for earlier, later in itertools.pairwise(letters))
    text = f'<?xml version="1.0"?><!DOCTYPE m [<!ENTITY a "aaaaaaaaaa">{names}]><model {NAMESPACE}>&j;</model>'
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("3D/3dmodel.model", text)
    return archive.getvalue()


HOSTILE = {
    "binary.stl": (bytes(80) + struct.pack("<I", 4_000_000_000) + bytes(50), "promises 4000000000"),
    "binary.ply": (HEADER.format("binary_little_endian").encode() + bytes(99), "promises 4000000000"),
    "ascii.ply": (HEADER.format("ascii").encode() + b"0 0 0\n", "promises 4000000000"),
    "counts.off": (b"OFF # a cube\n4000000000 12 0\n0 0 0\n", "promises 4000000000"),
    "negative.off": (b"OFF\n-5 12 0\n0 0 0\n", "promises -5"),
    "pickle.stl": (pickle.dumps(print), "no triangles"),
    "nonsense.glb": (b"glTF nonsense", "no GLB"),
    "cut.glb": (cube()[:200], "makes no sense"),
    "deep.glb": (struct.pack("<4sIII4s", b"glTF", 2, 200_020, 200_000, b"JSON") + b"[" * 200_000, "makes no sense"),
    "elsewhere.glb": (cube(buffers=[{"uri": "../../secret", "byteLength": 9}]), "names another file"),
    "picture.glb": (cube(images=[{"uri": "/etc/secret.png"}]), "names another file"),
    "sparse.glb": (cube(accessors=[{"componentType": 5126, "count": 10**10, "type": "VEC3"}]), "sparse"),
    "loop.glb": (cube(nodes=[{"children": [0], "mesh": 0}], scenes=[{"nodes": [0]}]), "contains itself"),
    "laugh.glb": (
        cube(nodes=[{"mesh": 0}, *({"children": [k, k]} for k in range(40))], scenes=[{"nodes": [40]}]),
        "more than 20,000 parts",
    ),
    "nonsense.3mf": (b"PK\3\4 nonsense", "no 3MF"),
    "words.3mf": (threemf("<", ""), "no 3MF"),
    "bomb.3mf": (threemf(SOLID, '<item objectid="1"/>', bomb=bytes(mesh_files.MAX_BYTES)), "unfolds to"),
    "climb.3mf": (threemf(SOLID, '<item objectid="1"/>', **{"../evil.model": b""}), "climbs out of its folder"),
    "loop.3mf": (
        threemf(
            SOLID + '<object id="2"><components><component objectid="2"/></components></object>',
            '<item objectid="2"/>',
        ),
        "contains itself",
    ),
    "laugh.3mf": (threemf(doubling(40), '<item objectid="41"/>'), "more than 20,000 parts"),
    "entities.3mf": (entities(), "no 3MF"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused(name, tmp_path):
    data, says = HOSTILE[name]
    (tmp_path / name).write_bytes(data)
    with pytest.raises(MeshError, match=says) as refused:
        mesh_files.load(tmp_path / name)
    assert str(refused.value).startswith(f"{tmp_path / name}: ")
    assert "; " in str(refused.value)  # what to do
    assert "\n" not in str(refused.value)


def volumes(path):
    return [trimesh.Trimesh(part.vertices, part.faces).volume for part in mesh_files.load(path).parts]


def test_harmless_ones_are_read(tmp_path):
    (tmp_path / "a.glb").write_bytes(cube())
    assert volumes(tmp_path / "a.glb") == pytest.approx([1])
    (tmp_path / "a.3mf").write_bytes(threemf(doubling(3), '<item objectid="4"/>' * 2))
    assert volumes(tmp_path / "a.3mf") == pytest.approx([8 / 6] * 2)


@pytest.mark.parametrize("suffix", [*mesh_files.READERS, ".STL"])
def test_every_kind_is_read(suffix, tmp_path):
    path = tmp_path / f"a b{suffix}"
    trimesh.creation.box((1, 2, 3)).export(path, file_type=suffix[1:].lower())
    assert volumes(path) == pytest.approx([6])
    assert mesh_files.load(str(path)).metres == {".glb": 1.0, ".3mf": 1e-3}.get(suffix)


@pytest.mark.filterwarnings("error")
def test_numbers_that_are_none_are_left_to_the_caller(tmp_path):
    data = bytearray(trimesh.creation.box().export(file_type="stl"))
    data[96:100] = b"\1\0\x80\x7f"  # a NaN that floating-point units complain of
    (tmp_path / "a.stl").write_bytes(data)
    assert np.isnan(mesh_files.load(tmp_path / "a.stl").parts[0].vertices).sum() == 1


def test_other_kinds(tmp_path):
    with pytest.raises(MeshError, match=r"a\.step: not a mesh file; use one of \.stl"):
        mesh_files.load(tmp_path / "a.step")


def test_whatever_a_reader_raises_names_the_file(tmp_path, monkeypatch):
    def broken(_):
        raise ZeroDivisionError("two\nlines")

    trimesh.creation.box().export(tmp_path / "a.stl")
    monkeypatch.setattr("rasp_core.io.stl.parse", broken)
    with pytest.raises(MeshError, match=r"a\.stl: cannot be read as a mesh \(two lines\); export it again"):
        mesh_files.load(tmp_path / "a.stl")


def test_a_damaged_archive(tmp_path):
    data = bytearray(threemf(SOLID, '<item objectid="1"/>'))
    data[60:90] = bytes(30)
    (tmp_path / "a.3mf").write_bytes(data)
    with pytest.raises(MeshError, match=r"is damaged|no 3MF"):
        mesh_files.read(tmp_path / "a.3mf")


def test_materials_name_no_files(tmp_path, monkeypatch):
    text = trimesh.creation.box().export(file_type="obj")
    (tmp_path / "a.obj").write_text(f"mtllib ../secret\nusemtl x\n{text}")
    opened = []
    monkeypatch.setattr("builtins.open", lambda name, *_, **__: opened.append(name))
    mesh_files.load(tmp_path / "a.obj")
    assert not opened


def test_files_and_bodies_that_are_too_large(tmp_path, monkeypatch):
    box = trimesh.creation.box()
    box.export(tmp_path / "a.stl")
    (tmp_path / "b.stl").write_bytes(box.export(file_type="stl") * 5)
    (tmp_path / "c.glb").write_bytes(cube(nodes=[{"children": [1] * 5}, {"mesh": 0}], scenes=[{"nodes": [0]}]))
    monkeypatch.setattr(bounds, "MAX_TRIANGLES", 11)
    with pytest.raises(MeshError, match=r"a\.stl: has 12 triangles, more than 11; simplify"):
        mesh_files.load(tmp_path / "a.stl")
    monkeypatch.setattr(bounds, "MAX_TRIANGLES", 12)
    for name in ("b.stl", "c.glb"):
        with pytest.raises(MeshError, match="has 60 triangles, more than 48; simplify"):
            mesh_files.load(tmp_path / name)
    monkeypatch.setattr(mesh_files, "MAX_NODES", 4)
    monkeypatch.setattr(bounds, "MAX_TRIANGLES", 100)
    with pytest.raises(MeshError, match="has more than 4 parts; save fewer"):
        mesh_files.load(tmp_path / "b.stl")
    monkeypatch.setattr(mesh_files, "MAX_BYTES", 100)
    with pytest.raises(MeshError, match="simplify the mesh"):
        mesh_files.read(tmp_path / "a.stl")


def test_what_is_no_file(tmp_path):
    (tmp_path / "endless.stl").symlink_to("/dev/zero")
    for name in ("endless.stl", "gone.stl", "a\0b.stl"):
        with pytest.raises(MeshError, match="no such file"):
            mesh_files.read(tmp_path / name)
    with pytest.raises(MeshError, match="a folder, and no mesh file"):
        mesh_files.read(tmp_path)


def test_a_file_that_may_not_be_read(tmp_path, monkeypatch):
    trimesh.creation.box().export(tmp_path / "a.stl")

    def denied(_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.read_bytes", denied)
    with pytest.raises(MeshError, match="Permission denied"):
        mesh_files.read(tmp_path / "a.stl")
