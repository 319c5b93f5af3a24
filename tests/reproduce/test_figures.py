"""Facts are compared as promised; notebooks are run, and their failures told."""

import io
import json
import shutil
import subprocess
import sys
from pathlib import Path

import nbformat
import numpy as np
import pytest
from IPython.core.interactiveshell import InteractiveShell
from matplotlib.figure import Figure
from PIL import Image

from rasp_core.reproduce import figures
from rasp_core.util.errors import InputError
from rasp_core.visualize import style

ROOT = Path(__file__).resolve().parents[2]


def notebook(root, name, code, tags=()):
    (root / "notebooks").mkdir(exist_ok=True)
    parameters = 'scale = "quick"\nout = "../out/figures/quick"'
    cells = [
        nbformat.v4.new_code_cell(parameters, metadata={"tags": ["parameters"]}),
        nbformat.v4.new_code_cell(code, metadata={"tags": list(tags)}),
    ]
    nbformat.write(nbformat.v4.new_notebook(cells=cells), root / "notebooks" / f"{name}.ipynb")


SAVE = """
from matplotlib.figure import Figure
from rasp_core.reproduce import figures
figures.save("01_test", Figure(), {"answer": 42.5, "scale": scale}, out)
print("made")
"""


def files(root):
    """All files below a folder, by their paths, with what is in them."""
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in root.rglob("*") if path.is_file()}


def expect(root, **bounds):
    (root / "paper_figures").mkdir(exist_ok=True)
    scales = {scale: {"answer": {"status": "reproduced", **bounds}} for scale in ("quick", "paper")}
    (root / "paper_figures" / "01_test.expected.json").write_text(json.dumps(scales))


def test_runs_are_kept_until_their_figure_would_be_another(tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "ROOT", tmp_path)
    (tmp_path / "data_fetch").mkdir()
    (tmp_path / "data_fetch" / "registry.csv").touch()
    (tmp_path / "requirements.lock").touch()
    notebook(tmp_path, "01_test", "print(1)  # one")
    first = figures.runs_folder("01_test", tmp_path / "out")
    notebook(tmp_path, "01_test", "print(1)")
    assert figures.runs_folder("01_test", tmp_path / "out") == first
    notebook(tmp_path, "01_test", "print(2)")
    assert figures.runs_folder("01_test", tmp_path / "out") != first
    assert first.parent == tmp_path / "out" / "runs"


def test_a_figure_is_saved_with_its_facts(tmp_path):
    path = figures.save("01_test", Figure(), {"answer": 42.5}, tmp_path / "new")
    assert sorted(f.name for f in path.parent.iterdir()) == ["01_test.json", "01_test.pdf", "01_test.png"]
    facts = json.loads(path.with_suffix(".json").read_text())
    assert facts["answer"] == 42.5
    assert "torch" in facts["versions"]


def test_what_a_notebook_keeps_of_a_figure_is_small_and_the_same_picture(tmp_path):
    steps = np.linspace(0, 255, 1200).astype(np.uint8)
    smooth = np.stack(np.broadcast_arrays(steps[None], steps[:600, None], np.uint8(90)), -1)
    Image.fromarray(np.ascontiguousarray(smooth)).save(tmp_path / "smooth.png")
    kept = figures.shown(tmp_path / "smooth.png", wide=400)
    with Image.open(io.BytesIO(kept.data)) as picture:
        assert (picture.format.lower(), picture.size) == (kept.format, (400, 200))
        assert np.abs(np.asarray(picture.convert("RGB"), int) - smooth[1::3, 1::3]).mean() < 4
    flat = Image.new("RGB", (80, 60), "white")
    flat.putpixel((3, 4), (0, 0, 0))
    flat.save(tmp_path / "flat.png")
    assert figures.shown(tmp_path / "flat.png").format == "png"


def test_small_text_is_told_and_kept_among_the_facts(tmp_path):
    figure = Figure()
    figure.text(0.5, 0.5, "small", fontsize=8)
    with pytest.warns(UserWarning, match=r"text of 5\.6 pixels at a third"):
        path = figures.save("01_test", figure, {}, tmp_path)
    assert json.loads(path.with_suffix(".json").read_text())["text, pixels at a third of the size"] == 5.6


@pytest.mark.parametrize("facts", sorted((ROOT / "paper_figures").glob("[0-9]*[a-z].json")), ids=lambda path: path.stem)
def test_stored_figures_are_legible_at_a_third_of_their_size(facts):
    if not facts.stem.endswith(".expected"):
        kept = json.loads(facts.read_text())
        assert kept.get("text, pixels at a third of the size", style.LEGIBLE_PX) >= style.LEGIBLE_PX


@pytest.mark.parametrize(
    "expected", sorted((ROOT / "paper_figures").glob("*.expected.json")), ids=lambda path: path.stem
)
def test_stored_facts_hold_or_are_said_to_differ(expected):
    name = expected.stem.removesuffix(".expected")
    for scale, wanted in json.loads(expected.read_text()).items():
        stored = expected.parent / ("" if scale == "quick" else scale) / f"{name}.json"
        verdicts = figures.compare(name, json.loads(stored.read_text()), wanted) if stored.exists() else []
        broken = [v.fact for v in verdicts if not v.holds and (scale == "quick" or v.status != "differs")]
        assert broken == []


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
    before = files(tmp_path)
    assert figures.run(root=tmp_path) == 0
    assert "≥ 42" in capsys.readouterr().out
    facts = json.loads((tmp_path / "out" / "figures" / "quick" / "01_test.json").read_text())
    assert (facts["scale"], facts["answer"]) == ("quick", 42.5)
    assert 0 < facts["seconds"] < 120
    after = files(tmp_path)
    assert {name for name in after if after[name] != before.get(name)} == {
        *(f"out/figures/quick/01_test.{kind}" for kind in ("json", "pdf", "png")),
        "out/notebooks/quick/01_test.ipynb",
    }
    expect(tmp_path, at_least=43)
    assert figures.run(["01_test"], "paper", root=tmp_path) == 1
    facts = json.loads((tmp_path / "out" / "figures" / "paper" / "01_test.json").read_text())
    assert facts["scale"] == "paper"
    assert (tmp_path / "out" / "notebooks" / "paper" / "01_test.ipynb").exists()


def test_quick_figures_and_their_notebooks_are_stored_where_asked(tmp_path):
    notebook(tmp_path, "01_test", SAVE + "display('large')")
    expect(tmp_path, at_least=42)
    shutil.copy(ROOT / ".gitignore", tmp_path)
    made, kept = tmp_path / "out" / "figures" / "quick", tmp_path / "paper_figures"
    made.mkdir(parents=True)
    (made / "01_test.gif").write_text("an older run's film")
    assert figures.run(store=True, root=tmp_path) == 0
    assert sorted(path.name for path in kept.iterdir()) == ["01_test.expected.json", "01_test.json", "01_test.png"]
    for kind in ("json", "png"):
        assert (kept / f"01_test.{kind}").read_bytes() == (made / f"01_test.{kind}").read_bytes()
    stored = nbformat.read(tmp_path / "notebooks" / "01_test.ipynb", 4)
    assert all(cell.execution_count for cell in stored.cells)
    assert stored.cells[1].outputs[0].text == "made\n"
    assert str(tmp_path) not in (tmp_path / "notebooks" / "01_test.ipynb").read_text()
    assert stored == nbformat.read(tmp_path / "out" / "notebooks" / "quick" / "01_test.ipynb", 4)


def test_paper_figures_are_stored_without_their_notebooks(tmp_path):
    notebook(tmp_path, "01_test", SAVE + "open(f'{out}/01_test.glb', 'w').close()")
    expect(tmp_path, at_least=42)
    shutil.copy(ROOT / ".gitignore", tmp_path)
    before = files(tmp_path / "notebooks")
    assert figures.run(scale="paper", store=True, root=tmp_path) == 0
    assert sorted(files(tmp_path / "paper_figures" / "paper")) == ["01_test.json", "01_test.png"]
    assert files(tmp_path / "notebooks") == before


def test_outputs_that_are_not_to_be_stored_stay_in_the_run(tmp_path):
    notebook(tmp_path, "01_test", SAVE, tags=["unstored"])
    expect(tmp_path, at_least=42)
    assert figures.run(store=True, root=tmp_path) == 0
    assert nbformat.read(tmp_path / "notebooks" / "01_test.ipynb", 4).cells[1].outputs == []
    assert nbformat.read(tmp_path / "out" / "notebooks" / "quick" / "01_test.ipynb", 4).cells[1].outputs


@pytest.mark.parametrize("folder", ["paper_figures", "paper_figures/paper"])
def test_what_git_ignores_is_what_is_not_stored(folder, tmp_path):
    """Git's own reading of .gitignore is the judge."""
    names = [f"{stem}.{kind}" for stem in ("01_a", "10_painted_art") for kind in ("json", "png", "pdf", "glb", "gif")]
    root = tmp_path / "root"
    (root / "paper_figures").mkdir(parents=True)
    shutil.copy(ROOT / ".gitignore", root)
    subprocess.run(["git", "init", "--quiet", root], check=True)
    for name in names:
        (tmp_path / name).write_text(name)
    figures._store([tmp_path / name for name in names], "paper" if folder.endswith("/paper") else "quick", root)
    asked = [f"{folder}/{name}" for name in names]
    done = subprocess.run(["git", "-C", root, "check-ignore", *asked], capture_output=True, text=True)
    kept = {path.relative_to(root).as_posix() for path in (root / "paper_figures").rglob("*") if path.is_file()}
    assert kept == set(asked) - set(done.stdout.split())
    assert f"{folder}/01_a.pdf" not in kept
    assert f"{folder}/01_a.png" in kept


NOISY = """
import numpy as np
from rasp_core.exact import certificate
from rasp_core.geometry import containers
from rasp_core.util import o3d
from data_fetch import kitchen_like
o3d.load()
bodies = kitchen_like(3)
certificate.certify(bodies, np.tile(np.eye(4), (3, 1, 1)), containers.box((1, 1, 1)))
"""


def test_standard_error_says_progress_and_nothing_else(tmp_path):
    """A real process, and what its notebook's process inherits: the kernel, open3d's dash and manifold3d are silent."""
    notebook(tmp_path, "01_test", NOISY + SAVE)
    notebook(tmp_path, "02_test", "1 / 0")
    code = "from pathlib import Path; from rasp_core.reproduce import figures; "
    code += f"figures.run(root=Path({str(tmp_path)!r}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    first, second = done.stderr.splitlines()
    assert first.startswith("01_test: ran in ")
    assert second.startswith("02_test: failed in cell 2: ZeroDivisionError: division by zero in ")


def test_a_terminal_sees_which_cell_is_run(tmp_path, capsys, monkeypatch):
    notebook(tmp_path, "01_test", SAVE)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    figures.run(root=tmp_path)
    assert "1/2" in capsys.readouterr().err


def test_a_notebook_shows_figures_in_few_colours(monkeypatch):
    figure = Figure(figsize=(6, 4.5))
    figure.subplots().imshow(np.random.default_rng(0).random((60, 80, 3)))
    shell = InteractiveShell()
    monkeypatch.setattr("IPython.get_ipython", lambda: shell)
    figures.inline()
    data, _ = shell.display_formatter.format(figure)
    with Image.open(io.BytesIO(data["image/png"])) as shown:
        assert shown.mode == "P"
        assert shown.width > 300
    monkeypatch.setattr("IPython.get_ipython", lambda: None)
    figures.inline()


def test_from_scratch_is_run_before_the_numbered_ones_and_others_are_not(tmp_path, capsys):
    for name in ("01_test", "from_scratch", "pack_your_own"):
        notebook(tmp_path, name, "1 / 0")
    assert figures.run(root=tmp_path) == 1
    said = capsys.readouterr().err
    assert [line.split(":")[0] for line in said.splitlines()] == ["from_scratch", "01_test"]


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


def test_a_notebook_whose_process_dies_says_so(tmp_path, capsys):
    notebook(tmp_path, "01_test", "import os, signal\nos.kill(os.getpid(), signal.SIGKILL)")
    assert figures.run(root=tmp_path) == 1
    assert "failed: its Python process died" in capsys.readouterr().out
    assert not list((tmp_path / "out" / "notebooks" / "quick").iterdir())
