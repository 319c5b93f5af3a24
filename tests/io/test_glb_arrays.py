"""Arrays of a GLB give the numbers that glTF 2 defines, and none from beyond their bytes."""

import base64
import struct

import numpy as np
import pytest

from rasp_core.io import bounds
from rasp_core.io.glb_arrays import GlbArrays
from rasp_core.util.errors import MeshError

ROWS = np.arange(12, dtype="<f4").reshape(4, 3)
PLAIN = {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}


def arrays(data, accessor, views=None, buffer=None):
    """One accessor on `data`."""
    views = [{"buffer": 0, "byteLength": len(data)}] if views is None else views
    tree = {"accessors": [accessor], "bufferViews": views, "buffers": [buffer or {"byteLength": len(data)}]}
    chunk = struct.pack("<I4s", 0, b"JSON") + struct.pack("<I4s", 3, b"ODD\0") + b"abc"
    return GlbArrays(tree, b"glTF" + bytes(8) + chunk + struct.pack("<I4s", len(data), b"BIN\0") + data)


@pytest.mark.parametrize(
    "uri", ["base64," + base64.b64encode(ROWS.tobytes()).decode(), "," + "".join(f"%{b:02x}" for b in ROWS.tobytes())]
)
def test_plain_ones_and_those_within_the_json(uri):
    np.testing.assert_array_equal(arrays(ROWS.tobytes(), PLAIN).array(0, "VEC3"), ROWS)
    within = {
        "uri": "data:application/octet-stream" + (";" if uri.startswith("base64") else "") + uri,
        "byteLength": 48,
    }
    views = [{"buffer": 0, "byteLength": 48}]
    np.testing.assert_array_equal(arrays(b"", PLAIN, views, within).array(0, "VEC3"), ROWS)


def test_interleaved_ones():
    data = np.hstack([ROWS, ROWS + 100]).astype("<f4").tobytes()
    views = [{"buffer": 0, "byteOffset": 0, "byteLength": 96, "byteStride": 24}]
    np.testing.assert_array_equal(arrays(data, PLAIN, views).array(0, "VEC3"), ROWS)
    np.testing.assert_array_equal(arrays(data, {**PLAIN, "byteOffset": 12}, views).array(0, "VEC3"), ROWS + 100)


@pytest.mark.parametrize(
    ("kind", "code", "values", "true"),
    [
        ("<i2", 5122, [-32768, -32767, 32767], [-1, -1, 1]),
        ("i1", 5120, [-128, 0, 127], [-1, 0, 1]),
        ("<u2", 5123, [0, 13107, 65535], [0, 0.2, 1]),
        ("u1", 5121, [0, 51, 255], [0, 0.2, 1]),
    ],
)
def test_normalised_ones(kind, code, values, true):
    given = {"bufferView": 0, "componentType": code, "count": 1, "type": "VEC3"}
    data = np.array(values, kind).tobytes()
    np.testing.assert_array_equal(arrays(data, given).array(0, "VEC3"), [values])
    np.testing.assert_allclose(arrays(data, {**given, "normalized": True}).array(0, "VEC3"), [true])


def test_sparse_ones():
    data = ROWS.tobytes() + struct.pack("<2H6f", 1, 3, *range(50, 56))
    views = [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 4}]
    views.append({"buffer": 0, "byteOffset": 52, "byteLength": 24})
    changes = {"count": 2, "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 2}}
    changed = ROWS.copy()
    changed[[1, 3]] = np.arange(50, 56).reshape(2, 3)
    np.testing.assert_array_equal(arrays(data, {**PLAIN, "sparse": changes}, views).array(0, "VEC3"), changed)
    nothing = {key: value for key, value in PLAIN.items() if key != "bufferView"}
    changed[[0, 2]] = 0
    np.testing.assert_array_equal(arrays(data, {**nothing, "sparse": changes}, views).array(0, "VEC3"), changed)
    np.testing.assert_array_equal(arrays(data, nothing, views).array(0, "VEC3"), np.zeros((4, 3)))
    with pytest.raises(MeshError, match="outside of themselves"):
        arrays(data, {**PLAIN, "count": 3, "sparse": changes}, views).array(0, "VEC3")


def test_sparse_ones_that_unfold_without_end(monkeypatch):
    monkeypatch.setattr("rasp_core.io.glb_arrays.MAX_TRIANGLES", 1)
    assert bounds.MAX_SCENE == 4
    with pytest.raises(MeshError, match="unfold to more than is read"):
        arrays(b"", {"componentType": 5126, "count": 13, "type": "VEC3"}).array(0, "VEC3")


@pytest.mark.parametrize(
    ("changes", "view", "says"),
    [
        ({"type": "VEC2"}, {}, "of type 'VEC2'"),
        ({"count": 5}, {}, "reach beyond its bytes"),
        ({"byteOffset": 4}, {}, "reach beyond its bytes"),
        ({}, {"byteLength": 47}, "reach beyond its bytes"),
        ({}, {"byteOffset": 4}, "reach beyond its bytes"),
        ({}, {"byteOffset": -4}, "make no sense"),
        ({}, {"byteStride": 4}, "make no sense"),
        ({"count": -1}, {}, "make no sense"),
    ],
)
def test_bytes_that_are_not_there(changes, view, says):
    views = [{"buffer": 0, "byteLength": 48, **view}]
    with pytest.raises(MeshError, match=says):
        arrays(ROWS.tobytes(), {**PLAIN, **changes}, views).array(0, "VEC3")


@pytest.mark.parametrize(("uri", "says"), [("elsewhere.bin", "names another file"), ("data:;base64,abc", "no base64")])
def test_buffers_that_are_not_there(uri, says):
    with pytest.raises(MeshError, match=says):
        arrays(b"", PLAIN, [], {"uri": uri, "byteLength": 48})


def test_no_rows():
    assert arrays(b"", {**PLAIN, "count": 0}).array(0, "VEC3").shape == (0, 3)
