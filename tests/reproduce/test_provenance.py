"""What a figure was made from: what changes its digests, and that the committed figures are made from what is here."""

import json
import shutil
from pathlib import Path

import nbformat
import pytest

from rasp_core.reproduce import provenance

ROOT = Path(__file__).resolve().parents[2]
FIGURES = sorted(path.name.split(".")[0] for path in (ROOT / "paper_figures").glob("*.expected.json"))


FILES = {
    "rasp_core/__init__.py": "import lazy_loader\n",
    "rasp_core/__init__.pyi": "from .first import run as run\nfrom .apart import x as x\n",
    "rasp_core/first.py": "from . import second\n\n\ndef run():\n    return second.f()\n",
    "rasp_core/second.py": '"""Words."""\nfrom .third import g\n\n\ndef f():\n    return g(f"{1:.{2}f}")\n',
    "rasp_core/third.py": "def g(x):\n    def inner():\n        from . import fourth\n\n    return x\n",
    "rasp_core/fourth.py": "y = 1\n",
    "rasp_core/apart.py": "x = 1\n",
    "data_fetch/registry.csv": "group,name\n",
    "requirements.lock": "torch==1\n",
}


def write(root, files, code="%matplotlib inline\nfrom rasp_core import first\nfirst.run()"):
    """A project of some modules, of which a notebook reaches all but `apart`."""
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    cells = [nbformat.v4.new_markdown_cell("Words."), nbformat.v4.new_code_cell(code)]
    nbformat.write(nbformat.v4.new_notebook(cells=cells), root / "a.ipynb")
    return root


@pytest.fixture
def project(tmp_path):
    return write(tmp_path, FILES)


def changed(root, before):
    after = provenance.sources(root / "a.ipynb", root)
    return {key for key in before if before[key] != after[key]}


def reached(code, root):
    return [path.stem for path in provenance.modules(code, root)]


def test_modules_are_followed(project):
    assert reached("import rasp_core.second", project) == ["fourth", "second", "third"]
    assert reached("from rasp_core.third import g", project) == ["fourth", "third"]
    assert reached("import rasp_core as rasp\nrasp.x", project) == ["apart"]
    assert reached("from rasp_core import run", project) == ["first", "fourth", "second", "third"]
    assert reached("import numpy", project) == []


@pytest.mark.parametrize(
    ("name", "text", "keys"),
    [
        ("rasp_core/second.py", FILES["rasp_core/second.py"].replace(".{2}f", ".{3}f"), {"core"}),
        ("rasp_core/fourth.py", "y = 2\n", {"core"}),
        ("rasp_core/second.py", FILES["rasp_core/second.py"].replace("Words", "Other") + "# one\n", set()),
        ("rasp_core/apart.py", "x = 2\n", set()),
        ("data_fetch/registry.csv", "group,name\na,b\n", {"registry"}),
        ("requirements.lock", "torch==2\n", {"lock"}),
    ],
)
def test_what_changes_a_digest(project, name, text, keys):
    before = provenance.sources(project / "a.ipynb", project)
    (project / name).write_text(text)
    assert changed(project, before) == keys


@pytest.fixture
def rooms():
    """The same code in rooms, two files under other names."""
    return {
        "rasp_core/first.py": "from .room.inner import next_\n\n\ndef run():\n    return next_.f()\n",
        "rasp_core/room/__init__.py": "",
        "rasp_core/room/inner/next_.py": FILES["rasp_core/second.py"].replace("from .third", "from ...third"),
        "rasp_core/third.py": FILES["rasp_core/third.py"].replace("from . import", "from .room import"),
        "rasp_core/room/fourth.py": "y = 1\n",
        **{name: FILES[name] for name in ("data_fetch/registry.csv", "requirements.lock")},
    }


def test_a_pure_move_changes_nothing(project, rooms, tmp_path):
    before = provenance.sources(project / "a.ipynb", project)
    assert changed(write(tmp_path / "moved", rooms), before) == set()


@pytest.mark.parametrize("name", ["rasp_core/room/inner/next_.py", "rasp_core/room/fourth.py"])
def test_a_change_of_code_in_any_room_tells(project, rooms, tmp_path, name):
    before = provenance.sources(project / "a.ipynb", project)
    rooms[name] += "z = 1\n"
    assert changed(write(tmp_path / "moved", rooms), before) == {"core"}


def test_an_import_from_elsewhere_tells(project):
    (project / "rasp_core" / "other.py").write_text("def g(x):\n    return 2 * x\n")
    before = provenance.sources(project / "a.ipynb", project)
    text = FILES["rasp_core/second.py"].replace("from .third", "from .other")
    (project / "rasp_core" / "second.py").write_text(text)
    assert changed(project, before) == {"core"}


def test_the_door_stands_for_what_it_leads_to(tmp_path):
    root = write(tmp_path, FILES, "import rasp_core as rasp\nrasp.run()")
    before = provenance.sources(root / "a.ipynb", root)
    (root / "rasp_core" / "apart.py").write_text("x = 2\n")
    assert changed(root, before) == set()
    (root / "rasp_core" / "fourth.py").write_text("y = 2\n")
    assert changed(root, before) == {"core"}


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


def test_the_digest_does_not_depend_on_the_python():
    """ast.dump and ast.unparse write differently from one Python to the next; these words must not."""
    code = 'def f(a, *b, c: int = 1) -> str:\n    "Words."\n    return f"{a!r:>{c}} {b}" "x"\n'
    assert provenance._digest(provenance._in_words(code)) == "9f08704702d81dee"


def test_a_copy_elsewhere_has_the_same_digests(tmp_path):
    for folder in ("rasp_core", "data_fetch", "notebooks"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "requirements.lock", tmp_path)
    notebook = "notebooks/00_quickstart.ipynb"
    assert provenance.sources(tmp_path / notebook, tmp_path) == provenance.sources(ROOT / notebook, ROOT)
