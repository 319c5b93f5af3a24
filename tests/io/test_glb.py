"""A GLB's default scene: what its nodes show, where they show it; what is not read is said."""

import json
import struct

import numpy as np
import pytest
import trimesh

from rasp_core.io.glb import parse
from rasp_core.util.errors import MeshError

BOX = trimesh.creation.box((1, 2, 3))
POINTS, SIDES = BOX.vertices.astype("<f4"), BOX.faces.astype("<u2")


def glb(data=b"", **tree):
    text = json.dumps({"asset": {"version": "2.0"}, **tree}).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def scene(nodes, primitive=None, arrays=(), meshes=None, **more):
    """A GLB of nodes that show the box, or arrays of their own, the first of which is its positions."""
    arrays = arrays or [POINTS, SIDES.reshape(-1, 1)]
    data, views, accessors = b"", [], []
    for array in arrays:
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
        code = {"<f4": 5126, "<u2": 5123, "|u1": 5121, "<u4": 5125}[array.dtype.str]
        kind = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[array.shape[1]]
        accessors.append({"bufferView": len(views) - 1, "componentType": code, "count": len(array), "type": kind})
        data += array.tobytes() + bytes(-array.nbytes % 4)
    meshes = meshes or [{"name": "box", "primitives": [primitive or {"attributes": {"POSITION": 0}, "indices": 1}]}]
    tree = {"nodes": nodes, "meshes": meshes, "accessors": accessors, "bufferViews": views, "scene": 0}
    children = {child for node in nodes for child in node.get("children", [])}
    roots = [k for k in range(len(nodes)) if k not in children]
    tree = {**tree, "scenes": [{"nodes": roots}], "buffers": [{"byteLength": len(data)}], **more}
    return glb(data, **{key: value for key, value in tree.items() if value is not None})


def volumes(file):
    return [trimesh.Trimesh(part.vertices, part.faces, process=False).volume for part in file.parts]


def test_names_and_places():
    turned = trimesh.transformations.quaternion_from_euler(0.1, 0.2, 0.3)  # w first
    trs = {"scale": [1, 2, 1], "rotation": [*turned[1:], turned[0]], "translation": [4, 5, 6]}
    matrix = trimesh.transformations.rotation_matrix(1, (1, 2, 3), (4, 5, 6))
    file = parse(
        scene([{"children": [1], "matrix": matrix.T.ravel().tolist()}, {"name": "a", "mesh": 0, **trs}, {"mesh": 0}])
    )
    assert (file.metres, file.notes) == (1.0, ())
    assert [part.name for part in file.parts] == ["a", "box"]
    inner = trimesh.transformations.compose_matrix(scale=(1, 2, 1), translate=(4, 5, 6), angles=(0.1, 0.2, 0.3))
    np.testing.assert_allclose(file.parts[0].vertices, trimesh.transform_points(POINTS, matrix @ inner), atol=1e-6)
    np.testing.assert_array_equal(file.parts[1].vertices, POINTS)
    assert volumes(file) == pytest.approx([12, 6])


def test_the_same_as_trimesh_reads():
    ours = trimesh.Scene([trimesh.creation.icosphere(2), trimesh.creation.cone(1, 2)])
    file = parse(ours.export(file_type="glb"))
    assert sorted(volumes(file)) == pytest.approx(sorted(mesh.volume for mesh in ours.geometry.values()), rel=1e-5)


def test_mirrors_keep_the_outside():
    assert volumes(parse(scene([{"mesh": 0, "scale": [-1, 1, 1]}]))) == pytest.approx([6])
    assert volumes(parse(scene([{"children": [1], "scale": [1, -1, 1]}, {"mesh": 0, "scale": [-1, 1, 1]}]))) == [6]


def test_only_the_default_scene():
    nodes = [{"mesh": 0}, {"mesh": 0, "scale": [2, 2, 2]}, {"mesh": 0}]
    file = parse(scene(nodes, scenes=[{"nodes": [0]}, {"nodes": [1]}], scene=1))
    assert volumes(file) == pytest.approx([48])
    assert file.notes == ("of its scenes only the default one is taken",)
    file = parse(scene(nodes, scenes=None, scene=None))
    assert len(file.parts) == 3
    assert file.notes == ("has no scene; all its nodes are taken",)


def test_instances():
    places = np.array([[0, 0, 0], [9, 0, 0]], "<f4")
    sizes, turns = np.array([[1, 1, 1], [2, 2, 2]], "<f4"), np.array([[0, 0, 0, 1], [0, 0, 1, 0]], "<f4")
    arrays = [POINTS, SIDES.reshape(-1, 1), places, sizes, turns]
    names = {"TRANSLATION": 2, "SCALE": 3, "ROTATION": 4}
    node = {"mesh": 0, "translation": [1, 0, 0], "extensions": {"EXT_mesh_gpu_instancing": {"attributes": names}}}
    file = parse(scene([node], arrays=arrays, extensionsRequired=["EXT_mesh_gpu_instancing"]))
    assert file.notes == ()
    assert volumes(file) == pytest.approx([6, 48])
    assert [part.vertices.mean(0).tolist() for part in file.parts] == [[1, 0, 0], [10, 0, 0]]
    with pytest.raises(MeshError, match="not as many in each array"):
        parse(scene([node], arrays=[*arrays[:3], sizes[:1], turns]))


@pytest.mark.parametrize("kind", ["<u2", "u1", "<u4"])
def test_indices_of_any_width(kind):
    assert volumes(parse(scene([{"mesh": 0}], arrays=[POINTS, SIDES.reshape(-1, 1).astype(kind)]))) == pytest.approx(
        [6]
    )


def test_no_indices():
    loose = BOX.triangles.reshape(-1, 3).astype("<f4")
    assert volumes(parse(scene([{"mesh": 0}], {"attributes": {"POSITION": 0}}, [loose]))) == pytest.approx([6])


@pytest.mark.parametrize(
    ("mode", "order", "faces"),
    [
        (5, [0, 1, 2, 3, 4], [[0, 1, 2], [2, 1, 3], [2, 3, 4]]),
        (5, [0, 1, 2, 2, 3, 3, 4, 5], [[0, 1, 2], [4, 3, 5]]),
        (6, [0, 1, 2, 3, 4], [[0, 1, 2], [0, 2, 3], [0, 3, 4]]),
        (4, [0, 1, 2, 3], [[0, 1, 2]]),
    ],
)
def test_strips_and_fans(mode, order, faces):
    points = np.random.default_rng(0).normal(size=(6, 3)).astype("<f4")
    indices = np.array(order, "<u2").reshape(-1, 1)
    file = parse(scene([{"mesh": 0}], {"attributes": {"POSITION": 0}, "indices": 1, "mode": mode}, [points, indices]))
    part = file.parts[0]
    np.testing.assert_array_equal(part.vertices[part.faces], points[faces].astype(float))
    assert file.notes == (("left out: 1 corners that make no whole triangle",) if mode == 4 else ())


def test_a_mesh_of_several_primitives():
    box, lines = {"attributes": {"POSITION": 0}, "indices": 1}, {"attributes": {"POSITION": 0}, "mode": 1}
    nameless = {"attributes": {}, "indices": 1}
    file = parse(scene([{"mesh": 0}], meshes=[{"primitives": [box, lines, box, nameless]}]))
    assert volumes(file) == pytest.approx([12])
    assert file.notes == ("left out: 1 primitives of points or lines", "left out: 1 primitives without positions")
    assert volumes(parse(scene([{"mesh": 0}], arrays=[np.vstack([POINTS, POINTS + 1]), SIDES.reshape(-1, 1)]))) == [6]


def test_what_is_not_read_is_said():
    node = {"mesh": 0, "skin": 0, "weights": [0, 0.5]}
    file = parse(scene([node], extensionsRequired=["KHR_materials_unlit", "ODD_one"]))
    assert file.notes == (
        "the extension 'ODD_one' is not read",
        "left out: 1 skins (bones move nothing here)",
        "left out: 1 shape keys that are not zero",
    )


def test_units_that_extras_state():
    box = {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}
    inch, mm = ({**box, "extras": {"units": unit}} for unit in ("inches", "mm"))
    file = parse(scene([{"mesh": 0}], meshes=[inch]))
    assert file.metres == 0.0254
    assert "unit is inches, which is taken" in file.notes[0]
    assert parse(scene([{"mesh": 0}, {"mesh": 1}], meshes=[inch, mm])).metres == 1.0
    assert parse(scene([{"mesh": 0}], meshes=[{**box, "extras": {"units": "odd"}}])).metres == 1.0


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (scene([{}]), "shows no triangles"),
        (scene([{"mesh": 0}], {"attributes": {"POSITION": 0}, "mode": 0}), "shows no triangles"),
        (scene([{"mesh": 0}], arrays=[POINTS[:4], SIDES.reshape(-1, 1)]), "vertices that are not there"),
        (scene([{"mesh": 3}]), "makes no sense"),
        (scene([{"mesh": 0, "matrix": [1, 2, 3]}]), "makes no sense"),
        (scene([{"mesh": 0, "scale": ["a", 1, 1]}]), "makes no sense"),
    ],
)
def test_what_is_refused(data, says):
    with pytest.raises(MeshError, match=says):
        parse(data)
