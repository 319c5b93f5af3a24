"""What a figure was made from: what changes its digests, and that the committed figures are made from what is here."""

import json
import shutil
from pathlib import Path

import nbformat
import pytest

from rasp_core import provenance

ROOT = Path(__file__).resolve().parent.parent
FIGURES = sorted(path.name.split(".")[0] for path in (ROOT / "paper_figures").glob("*.expected.json"))


@pytest.fixture
def project(tmp_path):
    """A kit of three modules, of which a notebook reaches two."""
    for name, code in {
        "rasp_core/__init__.py": "",
        "rasp_core/first.py": "from . import second\n",
        "rasp_core/second.py": '"""Words."""\n\n\ndef f():\n    return 1\n',
        "rasp_core/apart.py": "x = 1\n",
        "data_fetch/registry.csv": "group,name\n",
        "requirements.lock": "torch==1\n",
    }.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(code)
    cell = nbformat.v4.new_code_cell("%matplotlib inline\nfrom rasp_core import first")
    nbformat.write(
        nbformat.v4.new_notebook(cells=[nbformat.v4.new_markdown_cell("Words."), cell]), tmp_path / "a.ipynb"
    )
    return tmp_path


def test_modules_are_followed(project):
    names = [path.name for path in provenance.modules("import rasp_core.first", project)]
    assert names == ["__init__.py", "first.py", "second.py"] or names == ["first.py", "second.py"]
    assert provenance.modules("import numpy", project) == []


@pytest.mark.parametrize(
    ("name", "text", "changed"),
    [
        ("rasp_core/second.py", "def f():\n    return 2\n", {"core"}),
        ("rasp_core/second.py", '"""Other words."""\n\ndef f():  # one\n    return  1\n', set()),
        ("rasp_core/apart.py", "x = 2\n", set()),
        ("data_fetch/registry.csv", "group,name\na,b\n", {"registry"}),
        ("requirements.lock", "torch==2\n", {"lock"}),
    ],
)
def test_what_changes_a_digest(project, name, text, changed):
    before = provenance.sources(project / "a.ipynb", project)
    (project / name).write_text(text)
    after = provenance.sources(project / "a.ipynb", project)
    assert {key for key in before if before[key] != after[key]} == changed


def test_outputs_and_a_runs_own_parameters_change_nothing(project):
    before = provenance.sources(project / "a.ipynb", project)
    notebook = nbformat.read(project / "a.ipynb", as_version=4)
    notebook.cells[1].outputs = [nbformat.v4.new_output("stream", text="seen")]
    own = nbformat.v4.new_code_cell("scale = 'paper'", metadata={"tags": ["injected-parameters"]})
    notebook.cells.append(own)
    nbformat.write(notebook, project / "a.ipynb")
    assert provenance.sources(project / "a.ipynb", project) == before
    notebook.cells[1].source += "\nx = 1"
    nbformat.write(notebook, project / "a.ipynb")
    assert provenance.sources(project / "a.ipynb", project) != before


@pytest.mark.parametrize("name", FIGURES)
def test_no_committed_figure_is_older_than_what_it_depends_on(name):
    kept = json.loads((ROOT / "paper_figures" / f"{name}.json").read_text()).get("sources")
    now = provenance.sources(ROOT / "notebooks" / f"{name}.ipynb", ROOT)
    assert kept == now, f"older than its {', '.join(k for k in now if (kept or {}).get(k) != now[k])}: make it anew"


def test_a_copy_elsewhere_has_the_same_digests(tmp_path):
    for folder in ("rasp_core", "data_fetch", "notebooks"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "requirements.lock", tmp_path)
    notebook = "notebooks/00_quickstart.ipynb"
    assert provenance.sources(tmp_path / notebook, tmp_path) == provenance.sources(ROOT / notebook, ROOT)
