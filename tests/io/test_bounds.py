"""What a file promises is held to its bytes; whole files of this kind are in test_mesh_files."""

import io
import json
import struct
import zipfile

import pytest

from rasp_core.io import bounds
from rasp_core.util.errors import MeshError


def glb(tree, version=2):
    text = tree if isinstance(tree, bytes) else json.dumps(tree).encode()
    return struct.pack("<4sIII4s", b"glTF", version, 20 + len(text), len(text), b"JSON") + text


def test_triangles(monkeypatch):
    monkeypatch.setattr(bounds, "MAX_TRIANGLES", 10)
    bounds.check_triangles(10)
    bounds.check_triangles(40, 4)
    with pytest.raises(MeshError, match="has 11 triangles, more than 10; simplify the mesh"):
        bounds.check_triangles(11)


def test_rows():
    bounds.check_rows(b"abc", (0, 3))
    for count in (-1, 4):
        with pytest.raises(MeshError, match=f"promises {count} rows, which 3 bytes"):
            bounds.check_rows(b"abc", (count,))


def test_scenes():
    bounds.check_scene([1], {1: [2, 2], 2: []}, {2: 10})
    with pytest.raises(MeshError, match="contains itself"):
        bounds.check_scene([1], {1: [2], 2: [1]}, {})
    with pytest.raises(MeshError, match="more than 20,000 parts"):
        bounds.check_scene([1], {}, {}, {1: 20_001})
    with pytest.raises(MeshError, match="has 5,000,000 triangles, more than 4,000,000"):
        bounds.check_scene([1], {}, {1: 500_000}, {1: 10})


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"glTF", "no GLB"),
        (b"solid".ljust(30), "no GLB"),
        (glb({}, 1), "version 1"),
        (glb(b"{"), "makes no sense"),
        (glb([]), "makes no sense"),
    ],
)
def test_headers_of_a_glb(data, says):
    with pytest.raises(MeshError, match=says):
        bounds.glb_json(data)


def test_roots_of_a_glb():
    nodes = [{"children": [1]}, {}, {}]
    assert bounds.glb_roots({"nodes": nodes}) == [0, 2]
    assert bounds.glb_roots({"nodes": nodes, "scenes": [{"nodes": [0]}, {"nodes": [2]}], "scene": 1}) == [2]
    assert bounds.glb_roots({"nodes": nodes, "scenes": [{}]}) == []


@pytest.mark.parametrize(("mode", "count"), [(0, 0), (1, 0), (4, 3), (5, 7), (6, 7)])
def test_triangles_of_a_glb(mode, count):
    assert bounds.glb_triangles({"attributes": {"POSITION": 0}, "mode": mode}, [{"count": 9}]) == count
    assert bounds.glb_triangles({"indices": 1, "mode": mode}, [{"count": 1}, {"count": 9}]) == count


@pytest.mark.parametrize("word", ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"])
def test_compressed_ones(word):
    packed = {"extensions": {word: {}}}
    arrays = [{"count": 10**6}]  # more than the compressed bytes
    trees = [
        {"accessors": arrays, "meshes": [{"primitives": [{"indices": 0, **packed}]}]},
        {"accessors": arrays, "bufferViews": [packed]},
    ]
    for tree in trees:
        with pytest.raises(MeshError, match=rf"compressed \((Draco|meshopt), {word}\).*without compression"):
            bounds.CHECKS[".glb"](glb(tree))
    bounds.CHECKS[".glb"](glb({"extensionsUsed": [word], "scenes": [{}]}))


@pytest.mark.parametrize(
    ("tree", "says"),
    [
        ({"buffers": [{"uri": "a.bin"}]}, "names another file, 'a.bin'"),
        ({"images": [{"uri": "a.png"}]}, "names another file, 'a.png'"),
        ({"accessors": [{"count": 10**10}]}, "sparse arrays of 10000000000 rows"),
        ({"accessors": [{"count": 10**10, "bufferView": 0}]}, "promises 10000000000 rows"),
        ({"accessors": [{"count": 3, "bufferView": 0, "sparse": {"count": 10**10}}]}, "promises 10000000000 rows"),
        ({"accessors": [{}]}, "makes no sense"),
        ({"nodes": [{"mesh": 2}]}, "makes no sense"),
    ],
)
def test_what_a_glb_promises(tree, says):
    with pytest.raises(MeshError, match=says):
        bounds.CHECKS[".glb"](glb(tree))


@pytest.mark.parametrize(
    ("files", "root"),
    [
        ({"3D/3dmodel.model": ""}, "3D/3dmodel.model"),
        ({"3D/other.model": ""}, "3D/other.model"),
        ({"a.model": "", "b.model": ""}, ""),
        ({}, ""),
        ({"a.model": "", "b.model": "", "_rels/.rels": "<Relationship Id='1' Target='/B.model' {}/>"}, "b.model"),
        ({"a.model": "", "_rels/.rels": "<Relationship Target='/c.model' {}/>"}, ""),
        ({"a.model": "", "_rels/.rels": "<Relationship Target='/c.png' Type='picture'/>"}, "a.model"),
    ],
)
def test_the_first_model_of_a_3mf(files, root):
    kind = "Type='http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel'"
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as file:
        for name, text in files.items():
            file.writestr(name, text.format(kind))
    assert bounds.threemf_root(zipfile.ZipFile(archive)) == root


@pytest.mark.parametrize("name", ["/3D/a.model", "3D/a.model", "3d/x/../A.model", " /3D//a.model"])
def test_one_spelling(name):
    assert bounds.model_path(name) == "/3d/a.model"
