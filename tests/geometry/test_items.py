"""Parts by tables, words and items."""

import numpy as np
import pytest
import trimesh

from rasp_core.geometry.items import Item, bodies_of, item_of, read_table
from rasp_core.geometry.loading import Reading
from rasp_core.util.errors import InputError


@pytest.fixture
def folder(tmp_path):
    trimesh.creation.box((3, 2, 1)).export(tmp_path / "block.stl")
    trimesh.creation.cone(1, 2).export(tmp_path / "cone.stl")
    return tmp_path


def table(folder, text):
    path = folder / "parts.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_table_is_read_as_it_says(folder):
    text = (
        "file,count,must,priority,turns,scale,clearance,colour\n"
        "block.stl,3,yes,,z,2,5,#ff0000\n\n"
        "cone.stl,,no,1.5,flat:1,,,\n"
    )
    block, cone = read_table(table(folder, text), Reading(unit="mm"))
    assert block == Item(folder / "block.stl", 3, True, 0.0, "z", 2.0, 0.005, "#ff0000")
    assert cone == Item(folder / "cone.stl", priority=1.5, turns="flat:1")
    bodies = bodies_of([block, cone], Reading(unit="mm"))
    assert [body.name for body in bodies] == ["block", "block#2", "block#3", "cone"]
    assert bodies[0].volume == pytest.approx(6e-9 * 8)
    wishes = bodies[1].wishes
    assert (wishes.must, wishes.clearance, wishes.colour, wishes.turns.word) == (True, 0.005, (1, 0, 0), "z")
    assert bodies[3].wishes.priority == 1.5


def test_other_names_of_columns_are_known(folder):
    (item,) = read_table(table(folder, "file,quantity,rotate\nblock.stl,6,z only\n"))
    assert (item.count, item.turns) == (6, "z")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("file,count\nblock.stl,many\n", r"row 2, column count: a whole number from 0 to .* is expected, got 'many'$"),
        ("file,count\nblock.stl,-1\n", "row 2, column count: .* got '-1'$"),
        ("file,must\nblock.stl,maybe\n", "row 2, column must: yes or no is expected, got 'maybe'$"),
        ("file,priority\nblock.stl,1\nblock.stl,nan\n", "row 3, column priority: a number"),
        ("file,turns\nblock.stl,flat\n", "row 2, column turns: any, z, 90, .* is expected, got 'flat'$"),
        (
            "file,turns\nblock.stl,0 0 90; 0 90\n",
            "row 2, column turns: any, z, 90, .* such as 0 0 0; 90 0 0 is expected",
        ),
        ("file,scale\nblock.stl,0\n", "row 2, column scale: a positive number is expected"),
        ("file,clearance\nblock.stl,-2\n", "row 2, column clearance: a length of 0 or more"),
        ("file,colour\nblock.stl,red\n", "row 2, column colour: #rrggbb is expected, got 'red'"),
        ("file,count\n,3\n", "row 2, column file: the part's mesh is needed"),
        ("file,count\ngone.stl,3\n", r"row 2, column file: .*gone\.stl is not there$"),
        ("file,count\nblock.stl,3,4\n", "row 2 has 3 cells for 2 columns$"),
        ("file,weight\nblock.stl,3\n", "column 2 is called 'weight'; use each once of file, count, must"),
        ("file,count,quantity\nblock.stl,3,3\n", "column 2 is called 'count'; use each once"),
        ("count,turns\n3,z\n", "has no column file"),
        ("file,count\n\n\nblock.stl,few\n", "row 4, column count"),
        ("file;count\nblock.stl;3\n", "column 1 is called 'file;count'; use each once of file, count"),
        ("file,count\n", "needs a line of column names and a row below it"),
    ],
)
def test_bad_tables_are_refused_by_row_and_column(folder, text, message):
    with pytest.raises(InputError, match=message):
        read_table(table(folder, text))


def test_what_is_no_table_is_refused(folder):
    with pytest.raises(InputError, match="cannot be read"):
        read_table(folder / "none.csv")
    (folder / "parts.csv").write_bytes(b"\xff\xfe\x00\x01" * 9)
    with pytest.raises(InputError, match="cannot be read"):
        read_table(folder / "parts.csv")


def test_words_of_the_command_line_have_counts(folder):
    assert item_of("part.stl*12") == Item("part.stl", 12)
    assert item_of("part.stl") == Item("part.stl")
    odd = folder / "odd*2"
    odd.mkdir()
    assert item_of(str(odd)) == Item(str(odd))
    with pytest.raises(InputError, match=r"after \* a whole number of copies is needed"):
        item_of("part.stl*many")


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"count": -1}, "count must be"),
        ({"priority": np.inf}, "priority must be"),
        ({"scale": -1}, "scale must be"),
        ({"clearance": -1}, "clearance must be"),
        ({"turns": "x"}, "turns must be"),
        ({"colour": "#12345"}, "colour must be"),
    ],
)
def test_items_whose_fields_make_no_sense_are_refused(fields, message):
    with pytest.raises(InputError, match=message):
        Item("part.stl", **fields)


def test_no_parts_at_all_are_refused(folder):
    with pytest.raises(InputError, match="nothing to pack"):
        bodies_of([Item(folder / "block.stl", 0)])
