"""Each exercise: its solution is right by its own check, what it starts with is not, and it is stored with outputs."""

import contextlib
import io
from pathlib import Path

import nbformat
import pytest

EXERCISES = sorted((Path(__file__).resolve().parent.parent / "notebooks" / "exercises").glob("*.ipynb"))


def run(path):
    """The names that the notebook's cells define, and its cells by tag."""
    notebook, names, tagged = nbformat.read(path, as_version=4), {}, {}
    with contextlib.redirect_stdout(io.StringIO()):
        for cell in (c for c in notebook.cells if c.cell_type == "code"):
            exec(cell.source, names)
            tagged.update({tag: cell for tag in cell.metadata.get("tags", [])})
    return names, tagged


@pytest.mark.parametrize("path", EXERCISES, ids=lambda path: path.stem)
def test_solutions_are_right_and_starters_are_not(path):
    names, tagged = run(path)
    assert set(tagged) == {"exercise", "solution", "check"}
    assert names["check"](names["solution"]) == "right"
    (asked,) = tagged["check"].source.strip().splitlines()[-1:]
    assert eval(asked, names).startswith("not yet")
    assert tagged["solution"].metadata["jupyter"]["source_hidden"]
    assert tagged["check"].outputs, "stored with its output"


def test_the_guide_names_every_exercise():
    guide = (EXERCISES[0].parent / "README.md").read_text()
    assert all(path.name in guide for path in EXERCISES)
