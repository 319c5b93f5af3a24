"""Facts are compared as promised; notebooks are run, and their failures told."""

import json

import nbformat
import pytest
from matplotlib.figure import Figure

from rasp_core.reproduce import figures
from rasp_core.util.errors import InputError


def notebook(root, name, code):
    (root / "notebooks").mkdir(exist_ok=True)
    cells = [
        nbformat.v4.new_code_cell('scale = "quick"\nout = "../paper_figures"', metadata={"tags": ["parameters"]}),
        nbformat.v4.new_code_cell(code),
    ]
    nbformat.write(nbformat.v4.new_notebook(cells=cells), root / "notebooks" / f"{name}.ipynb")


SAVE = """
from matplotlib.figure import Figure
from rasp_core import figures
figures.save("01_test", Figure(), {"answer": 42.5, "scale": scale}, out)
"""


def expect(root, **bounds):
    (root / "paper_figures").mkdir(exist_ok=True)
    scales = {scale: {"answer": {"status": "reproduced", **bounds}} for scale in ("quick", "paper")}
    (root / "paper_figures" / "01_test.expected.json").write_text(json.dumps(scales))


def test_a_figure_is_saved_with_its_facts(tmp_path):
    path = figures.save("01_test", Figure(), {"answer": 42.5}, tmp_path / "new")
    assert sorted(f.name for f in path.parent.iterdir()) == ["01_test.json", "01_test.pdf", "01_test.png"]
    facts = json.loads(path.with_suffix(".json").read_text())
    assert facts["answer"] == 42.5
    assert "torch" in facts["versions"]


@pytest.mark.parametrize(
    ("bound", "holds"),
    [
        ({"value": 42, "tolerance": 1}, True),
        ({"value": 42, "tolerance": 0.1}, False),
        ({"at_least": 42}, True),
        ({"at_least": 43}, False),
        ({"at_most": 43}, True),
        ({"at_most": 42}, False),
        ({"equals": 42.5}, True),
        ({"equals": 42}, False),
    ],
)
def test_facts_are_held_against_their_bounds(bound, holds):
    wanted = {"answer": {"status": "reproduced", **bound}}
    (verdict,) = figures.compare("01_test", {"answer": 42.5}, wanted)
    assert verdict.holds is holds
    (missing,) = figures.compare("01_test", {}, wanted)
    assert not missing.holds
    assert ("NO" in figures.table([verdict])) is not holds


def test_expectations_without_bound_or_status_are_refused():
    with pytest.raises(InputError, match="no bound"):
        figures.compare("x", {"answer": 1}, {"answer": {"status": "differs"}})
    with pytest.raises(InputError, match="status 'fine'"):
        figures.compare("x", {"answer": 1}, {"answer": {"status": "fine", "equals": 1}})


def test_notebooks_are_run_and_their_facts_compared(tmp_path, capsys):
    notebook(tmp_path, "01_test", SAVE)
    expect(tmp_path, at_least=42)
    assert figures.run(root=tmp_path) == 0
    assert "≥ 42" in capsys.readouterr().out
    assert (tmp_path / "out" / "notebooks" / "quick" / "01_test.ipynb").exists()
    expect(tmp_path, at_least=43)
    assert figures.run(["01_test"], "paper", root=tmp_path) == 1
    facts = json.loads((tmp_path / "paper_figures" / "paper" / "01_test.json").read_text())
    assert facts["scale"] == "paper"
    assert 0 < facts["seconds"] < 120
    assert figures.run(store=True, root=tmp_path) == 1
    stored = nbformat.read(tmp_path / "notebooks" / "01_test.ipynb", 4)
    assert all(cell.execution_count for cell in stored.cells if cell.cell_type == "code")
    assert str(tmp_path) not in (tmp_path / "notebooks" / "01_test.ipynb").read_text()


def test_a_notebook_that_fails_says_where(tmp_path, capsys):
    notebook(tmp_path, "01_test", "1 / 0")
    assert figures.run(root=tmp_path) == 1
    assert "failed in cell 2: ZeroDivisionError: division by zero" in capsys.readouterr().out


def test_names_and_places_without_notebooks_are_refused(tmp_path):
    with pytest.raises(InputError, match="no notebooks"):
        figures.run(root=tmp_path)
    notebook(tmp_path, "01_test", SAVE)
    with pytest.raises(InputError, match="no figure named 02_gone; there are 01_test"):
        figures.run(["02_gone"], root=tmp_path)
    with pytest.raises(InputError, match="quick scale"):
        figures.run(scale="paper", store=True, root=tmp_path)


def test_a_notebook_whose_process_dies_says_so(tmp_path, capsys):
    notebook(tmp_path, "01_test", "import os, signal\nos.kill(os.getpid(), signal.SIGKILL)")
    assert figures.run(root=tmp_path) == 1
    assert "failed: its Python process died" in capsys.readouterr().out
    assert not list((tmp_path / "out" / "notebooks" / "quick").iterdir())
