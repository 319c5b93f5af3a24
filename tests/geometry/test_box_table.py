"""Tables of boxes: kinds, counts and files as they are written, or a line that says what is wrong."""

import pytest
import trimesh

from rasp_core.geometry.box_table import read_boxes
from rasp_core.geometry.loading import Reading
from rasp_core.util.errors import InputError


def test_a_table_names_kinds_in_its_order(tmp_path):
    table = tmp_path / "boxes.csv"
    table.write_text('container,count\n"box:0.01,0.2,0.2"\n"box:0.15,0.15,0.12",auto\n')
    rooms, counts = zip(*read_boxes(table, directions=[(0, 0)]), strict=True)
    assert [room.size.tolist() for room in rooms] == [[0.01, 0.2, 0.2], [0.15, 0.15, 0.12]]
    assert counts == (1, None)
    assert len(rooms[1].views()) == 1


def test_meshes_and_vessels_lie_beside_the_table(tmp_path):
    trimesh.creation.icosphere(radius=100).export(tmp_path / "ball.stl")
    outer, inner = (trimesh.creation.cylinder(radius, height=200) for radius in (100, 90))
    inner.apply_translation((0, 0, 10))
    trimesh.boolean.difference([outer, inner], engine="manifold").export(tmp_path / "pot.stl")
    table = tmp_path / "boxes.csv"
    table.write_text('Container,count\nball.stl,2\n"box:100,100,100",\ncavity:pot.stl,3\n')
    (ball, two), (box, one), (cavity, three) = read_boxes(table, Reading("mm"))
    assert (two, one, three) == (2, 1, 3)
    assert ball.volume == pytest.approx(4 / 3 * 3.1416 * 0.1**3, rel=0.05)
    assert box.size.tolist() == pytest.approx([0.1, 0.1, 0.1])
    assert cavity.volume == pytest.approx(3.1416 * 0.09**2 * 0.19, rel=0.05)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "container,count\nball.stl,0\n",
            "row 2, column count: a whole number from 1 to 1000, or auto in the last row",
        ),
        ("container,count\nball.stl,auto\nball.stl,1\n", "row 2, column count: .*, got 'auto'"),
        ("container\nball.stl\n", r"row 2, column container: .*ball\.stl"),
        ('container\n"box:1,2"\n', "row 2, column container: .* is not a box; write"),
        ("count\n3\n", "has no column container, box:X,Y,Z or a mesh file"),
        ("container,count\n,3\n", "row 2, column container: box:X,Y,Z or a mesh file is needed"),
    ],
)
def test_bad_tables_of_boxes_are_refused(tmp_path, text, told):
    (tmp_path / "boxes.csv").write_text(text)
    with pytest.raises(InputError, match=told):
        read_boxes(tmp_path / "boxes.csv")
