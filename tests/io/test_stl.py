"""STL in all its dialects, against trimesh's own export; what cannot be right is refused by its reason."""

import struct

import numpy as np
import pytest
import trimesh

from rasp_core.io.stl import parse
from rasp_core.util.errors import MeshError

BOX = trimesh.creation.box((1, 2, 3))
BINARY = BOX.export(file_type="stl")
TEXT = "solid part\n" + BOX.export(file_type="stl_ascii").split("\n", 1)[1].rsplit("endsolid", 1)[0] + "endsolid part\n"
ONE = TEXT.partition("\n")[2].partition("endfacet")[0] + "endfacet\n"  # the first facet


def surface(part):
    return part.vertices[part.faces]


def same(file, count=1):
    assert len(file.parts) == count
    assert file.metres is None
    for part in file.parts:
        assert part.vertices.dtype == np.float64
        assert part.faces.dtype == np.int64
        np.testing.assert_allclose(surface(part), BOX.triangles, atol=1e-6)


@pytest.mark.parametrize(
    "header", [b"solid part" + bytes(70), b"solid part".ljust(80), b"COLOR=\xff\0\0\xff".ljust(80), bytes(80)]
)
def test_binary_whatever_its_header(header):
    same(parse(header + BINARY[80:]))


def test_binary_with_more_behind_it():
    file = parse(BINARY + b"x" * 64)
    same(file)
    assert file.notes == ("64 bytes after the last triangle are left out",)
    same(parse(BINARY + BINARY), count=2)
    same(parse(BINARY + BINARY + b"x" * 3))


@pytest.mark.parametrize(
    "data",
    [
        TEXT.encode(),
        TEXT.replace("\n", "\r").encode(),
        TEXT.replace("\n", "\r\n").encode(),
        TEXT.upper().encode(),
        TEXT.encode("utf-8-sig"),
        TEXT.encode("utf-16"),
        b"\n \n\n" + TEXT.encode(),
        TEXT.replace("endsolid", "end solid").encode(),
        TEXT.replace("endfacet", "end facet").replace("endloop", "end loop").encode(),
        " ".join(TEXT.split()).encode(),
        TEXT.replace("solid part", "solid a facet of a solid vertex").encode(),
        TEXT.replace("solid part", "solid").encode(),
    ],
)
def test_text(data):
    file = parse(data)
    same(file)
    assert file.notes == ()


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_names(encoding):
    name = "Gehäuse 3/4" + (" İ" if encoding == "utf-8" else "")
    file = parse(TEXT.replace("part", name).encode(encoding))
    assert file.parts[0].name == name
    same(file)


def test_several_solids():
    file = parse((TEXT + TEXT.replace("part", "other part") + TEXT.replace(" part", "")).encode())
    assert [part.name for part in file.parts] == ["part", "other part", ""]
    same(file, count=3)


def test_without_an_end():
    file = parse(TEXT.partition("endsolid")[0].encode())
    same(file)
    assert file.notes == ("has no endsolid line at its end; it may be cut off",)


def test_loops_of_four_corners_and_no_normals():
    square = (
        "solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid"
    )
    part = parse(square.encode()).parts[0]
    assert trimesh.Trimesh(part.vertices, part.faces, process=False).area == pytest.approx(1)


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (bytes(80) + struct.pack("<I", 4_000_000_000) + bytes(50), "promises 4000000000 triangles, .* bytes for 1"),
        (b"solid".ljust(80) + struct.pack("<I", 12) + BINARY[84:-1], "promises 12 triangles, .* bytes for 11"),
        (bytes(84 + 100), "holds no triangles by its header, and bytes for 2"),
        (b"\0\1\2", "holds no triangles, and is no STL"),
        (b"", "holds no triangles"),
        (b"just some words " * 20, "holds no triangles"),
        (b"solid a\nendsolid a\n", "holds no triangles"),
        (TEXT.replace(".", ",").encode(), "decimal comma"),
        (TEXT.replace("0.5", "one").encode(), "one' stands where a number"),
        (TEXT[: TEXT.rindex("endfacet")].encode(), "cut off in its facet 12"),
        (TEXT[: TEXT.rindex("vertex")].encode(), "cut off in its facet 12"),
        (("solid\n" + ONE.replace("vertex", "corner", 1) + "endsolid").encode(), "facet 1 has no three corners"),
        (b"solid\nfacet\nvertex 1 2 3\nvertex 1 2 3\nvertex 1 2 3\nvertex 1 2\nendfacet\nendsolid", "no three corners"),
    ],
)
def test_what_is_refused(data, says):
    with pytest.raises(MeshError, match=says):
        parse(data)
