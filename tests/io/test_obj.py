"""OBJ in its dialects, against trimesh's own export and against a box written by hand."""

import codecs

import numpy as np
import pytest
import trimesh

from rasp_core.io.obj import parse
from rasp_core.util.errors import MeshError

CORNERS = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 2) for z in (0, 3))
QUADS = ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))


def box(corner="{0}", before="", corners=CORNERS, first=0):
    """A box of 1 x 2 x 3 of quads, whose corners are written by `corner`."""
    return (
        corners + before + "".join(f"f {' '.join(corner.format(c + first, c - 9) for c in quad)}\n" for quad in QUADS)
    )


def volume(part):
    return trimesh.Trimesh(part.vertices, part.faces, process=False).volume


@pytest.mark.parametrize("corner", ["{0}", "{0}/{0}", "{0}//{0}", "{0}/{0}/{0}", "{1}", "{1}/{1}/{1}"])
@pytest.mark.parametrize("end", ["\n", "\r", "\r\n", " # words\n", "\n\n"])
def test_corners_and_line_ends(corner, end):
    file = parse(box(corner).replace("\n", end).encode())
    assert file.metres is None
    assert file.notes == ()
    assert [part.name for part in file.parts] == [""]
    assert file.parts[0].faces.shape == (12, 3)
    assert volume(file.parts[0]) == pytest.approx(6)


@pytest.mark.parametrize(
    "data",
    [
        box().encode("utf-8-sig"),
        codecs.BOM_UTF16_BE + box().encode("utf-16-be"),
        box().replace("f 1 2 4", "f 1 2 \\\n 4").encode(),
        box().replace(" ", "\t").encode(),
        box(corners=CORNERS.replace("\n", " 0.5 0.5 0.5\n")).encode(),  # colours
        box(before="mtllib nothing.mtl\nusemtl a b\ng one\ns off\nvn 0 0 1\nvt 0 0\n").encode(),
        (box()[len(CORNERS) :] + CORNERS).encode(),  # faces before their vertices
    ],
)
def test_other_words(data):
    file = parse(data)
    assert [volume(part) for part in file.parts] == pytest.approx([6])


def test_the_same_as_trimesh_reads():
    ball = trimesh.creation.icosphere(2)
    part = parse(ball.export(file_type="obj").encode()).parts[0]
    np.testing.assert_allclose(part.vertices[part.faces], ball.triangles, atol=1e-7)


def test_objects_are_parts_and_groups_are_none():
    second = box("{1}", "o the second\ng group\n", CORNERS.replace("v 1", "v 2"))
    file = parse((box(before="o first\n") + second + box("{1}", "o first\n", CORNERS.replace("v 0", "v 5"))).encode())
    assert [part.name for part in file.parts] == ["first", "the second"]
    assert volume(file.parts[1]) == pytest.approx(12)
    assert [len(part.vertices) for part in file.parts] == [16, 8]


def test_what_is_left_out_is_said():
    file = parse((box() + "l 1 2\nl 2 3\np 1\nf 1 2\ncurv 0 1 1 2\n").encode())
    assert file.notes == (
        "2 lines are left out",
        "1 points are left out",
        "1 free-form curves and surfaces are left out",
        "1 faces of fewer than three corners are left out",
    )
    assert volume(file.parts[0]) == pytest.approx(6)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "holds no triangles"),
        (CORNERS, "point cloud"),
        (CORNERS + "l 1 2 3\n", "lines and points only"),
        (CORNERS + "p 1\n", "lines and points only"),
        (CORNERS + "surf 0 1 0 1 1 2 3\n", "free-form"),
        (CORNERS + "f 1 2\n", "holds no triangles"),
        (CORNERS + "f 0 1 2\n", "vertex 0"),
        (CORNERS + "f 1 2 9\n", "vertices that are not there"),
        (CORNERS + "f 1 2 -9\n", "vertices that are not there"),
        (CORNERS + "f 1 2 x\n", "'x' stands where a whole number"),
        ("v 1 2\nf 1 1 1\n", "fewer than three numbers"),
        ("v 1 2 x\nf 1 1 1\n", "'x' stands where a number"),
        ("v 1,5 2 3\nf 1 1 1\n", "decimal comma"),
    ],
)
def test_what_is_refused(text, says):
    with pytest.raises(MeshError, match=says):
        parse(text.encode())
