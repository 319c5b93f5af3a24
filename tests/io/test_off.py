"""OFF in its dialects: one box, written in as many ways."""

import numpy as np
import pytest
import trimesh

from rasp_core.io.off import parse
from rasp_core.util.errors import MeshError

CORNERS = [f"{x} {y} {z}" for x in (0, 1) for y in (0, 2) for z in (0, 3)]
QUADS = ["4 0 1 3 2", "4 4 6 7 5", "4 0 4 5 1", "4 2 3 7 6", "4 0 2 6 4", "4 1 5 7 3"]


def box(head="OFF\n8 6 12", corner="", face=""):
    return "\n".join([head, *(c + corner for c in CORNERS), *(q + face for q in QUADS)]) + "\n"


@pytest.mark.parametrize(
    "text",
    [
        box(),
        box("OFF 8 6 12"),
        box("OFF8 6 12"),
        box("8 6 12"),
        box("OFF\n8 6"),
        box("OFF # words 1 2 3\n# more\n\n8 6 12"),
        box(face=" 255 0 0"),
        box(face=" 0.1 0.2 0.3 1"),
        box("COFF\n8 6 12", " 1 0 0 1"),
        box("COFF\n8 6 12", " 255 0 0"),
        box("OFF\n8 6 12", " 255 0 0"),
        box("NOFF\n8 6 12", " 0 0 1"),
        box("STOFF\n8 6 12", " 0 0"),
        box("CNOFF\n8 6 12", " 0 0 1 1 0 0 1"),
        "\n".join(box().split()),
        " ".join(box().split()),
        "\n".join(box("CNOFF\n8 6 12", " 0 0 1 1 0 0 1").split()),
        "\n".join(box("STOFF\n8 6 12", " 0 0").split()),
        box().replace("\n", "\r"),
        box().replace("\n", "\r\n"),
        "\ufeff" + box(),
    ],
)
def test_dialects(text):
    file = parse(text.encode())
    assert (file.metres, file.notes, len(file.parts)) == (None, (), 1)
    part = file.parts[0]
    assert (part.name, part.vertices.dtype, part.faces.shape) == ("", np.float64, (12, 3))
    assert trimesh.Trimesh(part.vertices, part.faces, process=False).volume == pytest.approx(6)


def test_the_same_as_trimesh_writes():
    ball = trimesh.creation.icosphere(2)
    part = parse(ball.export(file_type="off", digits=9).encode()).parts[0]
    np.testing.assert_allclose(part.vertices, ball.vertices, atol=1e-8)
    np.testing.assert_array_equal(part.faces, ball.faces)


def test_faces_of_two_corners():
    file = parse(box("OFF\n8 7 0").encode() + b"2 0 1\n")
    assert file.notes == ("1 faces of fewer than three corners are left out",)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "cut off before its counts"),
        ("OFF\n", "cut off before its counts"),
        ("solid x", "is no OFF"),
        ("OFF BINARY\n8 6 12", "binary OFF"),
        ("4OFF\n8 6 12", "other than three coordinates"),
        ("OFF\n4000000000 12 0\n0 0 0\n", "promises 4000000000"),
        ("OFF\n-5 12 0\n0 0 0\n", "promises -5"),
        ("OFF\n8 0 0\n" + "\n".join(CORNERS), "point cloud"),
        ("OFF\n0 0 0\n", "holds no triangles"),
        ("OFF\n8 1 0\n" + "\n".join(CORNERS) + "\n2 0 1", "holds no triangles"),
        (box("OFF\n8 7 12"), "promises 7 faces, and 6 are there"),
        ("OFF\n8 6 12\n0 0 0\n", "promises 8 vertices"),
        (box().replace("4 1 5 7 3", "4 1 5 7"), "promises 6 faces, and 5 are there"),
        (" ".join(box(face=" 7").split()), "numbers after its last face|stands where|promises"),
        (box() + "1 2 3\n", "3 numbers after its last face"),
        (box().replace("4 1 5 7 3", "4 1 5 7 8"), "vertices that are not there"),
        (box().replace("0 0 3", "0 0 x"), "'x' stands where a number"),
        (box("OFF\n8 6.5 0"), "'6.5' stands where a whole number"),
    ],
)
def test_what_is_refused(text, says):
    with pytest.raises(MeshError, match=says):
        parse(text.encode())
