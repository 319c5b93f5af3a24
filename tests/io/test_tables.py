"""Tables: what is read, and the row and column that are named where it cannot be. More in geometry and api."""

import pytest

from rasp_core.io import tables
from rasp_core.util.errors import InputError


def read(tmp_path, text):
    (tmp_path / "t.csv").write_text(text, encoding="utf-8-sig")
    return tables.rows(tmp_path / "t.csv", {"file": "a mesh"}, ("count",), {"number": "count"})


def test_cells_are_read_by_name_with_their_lines(tmp_path):
    assert read(tmp_path, "File, number\n a.stl ,3\n\nb.stl,\nc.stl\n") == [
        (2, {"file": "a.stl", "count": "3"}),
        (4, {"file": "b.stl"}),
        (5, {"file": "c.stl"}),
    ]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("file\n", "needs a line of column names and a row below it"),
        ("file,weight\na,1\n", "column 2 is called 'weight'; use each once of file, count"),
        ("file,count,number\na,1,1\n", "column 2 is called 'count'"),
        ("count\n1\n", "has no column file, a mesh"),
        ("file\na,b\n", "row 2 has 2 cells for 1 columns"),
        ("file,count\n,1\n", "row 2, column file: a mesh is needed, got nothing"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, text, told):
    with pytest.raises(InputError, match=told):
        read(tmp_path, text)


def test_what_is_no_table_is_refused(tmp_path):
    with pytest.raises(InputError, match="the table cannot be read"):
        tables.rows(tmp_path / "none.csv", {})
