"""PLY as text and as bytes of either order, with whatever properties, against numbers by hand and trimesh's export."""

import itertools
import struct

import numpy as np
import pytest
import trimesh

from rasp_core.io.ply import parse
from rasp_core.util.errors import MeshError

CORNERS = list(itertools.product((0, 1), (0, 2), (0, 3)))
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
MIXED = [(0, 1, 3), (0, 3, 2), *QUADS[1:]]
CODES = {"float": "f", "double": "d", "int": "i", "short": "h", "uchar": "B", "char": "b", "uint": "I", "ushort": "H"}


def ply(
    order="ascii", scalar="float", count="uchar", index="int", faces=QUADS, name="vertex_indices", end="\n", more=()
):
    """A box of 1 x 2 x 3. more : "face" for texture coordinates and a flag of each, "edge" for other rows before."""
    lines = ["ply", f"format {order} 1.0", "comment by hand", f"element vertex {len(CORNERS)}"]
    lines += [f"property {scalar} {axis}" for axis in "xyz"] + ["property uchar red"]
    if "edge" in more:
        lines += ["element edge 1", "property int vertex1", "property int vertex2"]
    lines += [f"element face {len(faces)}"]
    if "face" in more:
        lines += ["property list uchar float texcoord", "property uchar flags"]
    lines += [f"property list {count} {index} {name}", "end_header"]
    rows = [[*((scalar, x) for x in corner), ("uchar", 9)] for corner in CORNERS]
    rows += [[("int", 0), ("int", 1)]] if "edge" in more else []
    for face in faces:
        extra = [("uchar", 2), ("float", 0.5), ("float", 0.25), ("uchar", 1)] if "face" in more else []
        rows.append([*extra, (count, len(face)), *((index, corner) for corner in face)])
    head = end.join(lines).encode() + end.encode()
    if order == "ascii":
        return head + end.join(" ".join(str(x) for _, x in row) for row in rows).encode() + end.encode()
    mark = ">" if "big" in order else "<"
    return head + b"".join(struct.pack(mark + CODES[kind], x) for row in rows for kind, x in row)


def check(data):
    file = parse(data)
    assert (file.metres, file.notes, len(file.parts)) == (None, (), 1)
    part = file.parts[0]
    assert (part.name, part.vertices.dtype, part.faces.dtype) == ("", np.float64, np.int64)
    np.testing.assert_array_equal(part.vertices, CORNERS)
    assert trimesh.Trimesh(part.vertices, part.faces, process=False).volume == pytest.approx(6)


@pytest.mark.parametrize("order", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("faces", [QUADS, MIXED])
@pytest.mark.parametrize("more", [(), ("face",), ("edge", "face")])
@pytest.mark.parametrize(
    ("scalar", "count", "index"), [("float", "uchar", "int"), ("double", "int", "uint"), ("short", "ushort", "uchar")]
)
def test_types_and_orders(order, faces, more, scalar, count, index):
    check(ply(order, scalar, count, index, faces, more=more))


@pytest.mark.parametrize("order", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize("end", ["\n", "\r", "\r\n"])
def test_headers(order, end):
    check(ply(order, end=end, name="vertex_index"))
    check(b"\n" + ply(order, end=end))
    check(ply(order).replace(b"end_header\n", b"end_header\r\n"))
    check(ply(order).replace(b"uchar red", b"uint8 red").replace(b"list uchar int", b"list  uint8  int32 "))


def test_text_whose_rows_have_no_lines():
    head, _, rows = ply().partition(b"end_header\n")
    check(head + b"end_header\n" + b"\n".join(rows.split()))


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_the_same_as_trimesh_writes(encoding):
    ball = trimesh.creation.icosphere(2)
    part = parse(ball.export(file_type="ply", encoding=encoding)).parts[0]
    np.testing.assert_allclose(part.vertices, ball.vertices, atol=1e-6)
    np.testing.assert_array_equal(part.faces, ball.faces)


def test_triangle_strips():
    head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    head += "element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
    part = parse((head + "12 0 2 1 3 -1 0 3 2 -1 1 2 3\n").encode()).parts[0]
    assert part.faces.tolist() == [[0, 2, 1], [1, 2, 3], [0, 3, 2], [1, 2, 3]]
    assert parse((head + "5 0 2 2 1 3\n").encode()).parts[0].faces.tolist() == [[2, 1, 3]]


def test_faces_of_two_corners():
    assert parse(ply(faces=[*QUADS, (0, 1)])).notes == ("1 faces of fewer than three corners are left out",)


HEAD = "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"nothing", "is no PLY"),
        (b"ply\nformat ascii 1.0\n", "its header has no end"),
        (b"ply\nend_header\n", "names no format"),
        (b"ply\nformat middle 1.0\nend_header\n", "'format middle 1.0' makes no sense"),
        (b"ply\nformat ascii 1.0\nproperty float x\nend_header\n", "'property float x' makes no sense"),
        (b"ply\nformat ascii 1.0\nelement vertex\nend_header\n", "'element vertex' makes no sense"),
        (HEAD.format(4_000_000_000).encode() + b"0 0 0\n", "promises 4000000000"),
        (HEAD.format(-1).encode(), "promises -1"),
        (HEAD.format(2).encode() + b"0 0 0\n1 1\n", "cut off: it promises 2 of 'vertex'"),
        (HEAD.format(2).encode() + b"0 0 0\n1 1 1\n", "point cloud"),
        (HEAD.format(0).encode(), "holds no triangles"),
        (HEAD.replace("float z", "float w").format(1).encode() + b"0 0 0\n", "no x, y and z"),
        (HEAD.format(1).encode() + b"0 0 x\n", "'x' stands where a number"),
        (ply(faces=[]), "point cloud"),
        (ply(faces=[(0, 1)]), "holds no triangles"),
        (ply(faces=[(0, 1, 8)]), "vertices that are not there"),
        (ply(name="corners"), "no vertex_indices"),
        (ply()[:-3], "cut off: it promises 6 of 'face'"),
        (ply().replace(b"4 0 1 3 2", b"-4 0 1 3 2"), "cut off: it promises 6 of 'face'"),
        (ply().replace(b"4 0 1 3 2", b"x 0 1 3 2"), "cut off: it promises 6 of 'face'"),
        (ply().replace(b"4 0 1 3 2", b"4 0 1 3 2.5"), "not whole"),
        (ply().replace(b"4 0 1 3 2", b"4 0 1 3 nan"), "not whole"),
        (ply("binary_little_endian")[:-1], "cut off: it promises 6 of 'face'"),
        (ply("binary_big_endian", faces=MIXED)[:-1], "cut off: it promises 7 of 'face'"),
        (ply("binary_little_endian", count="char").replace(b"\x04\0\0\0\0\1", b"\xff\0\0\0\0\1"), "cut off"),
        (ply("binary_little_endian").partition(b"end_header\n")[0] + b"end_header\n", "cut off: it promises 8"),
    ],
)
def test_what_is_refused(data, says):
    with pytest.raises(MeshError, match=says):
        parse(data)
