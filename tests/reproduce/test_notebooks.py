"""A notebook is run in its own process, in its folder; what it is stored with."""

import nbformat
import pytest

from rasp_core.reproduce import notebooks
from rasp_core.visualize.recording_page import WIDGET


@pytest.fixture
def made(tmp_path):
    """A way to write a notebook of one cell with a parameter before it."""

    def write(code, tags=()):
        parameters = nbformat.v4.new_code_cell("n = 1", metadata={"tags": ["parameters"]})
        cell = nbformat.v4.new_code_cell(code, metadata={"tags": list(tags)})
        nbformat.write(nbformat.v4.new_notebook(cells=[parameters, cell]), tmp_path / "a.ipynb")
        return tmp_path / "a.ipynb"

    return write


def test_it_runs_in_its_folder_with_parameters_and_forgets_where_that_was(made, tmp_path):
    path, target = made("from pathlib import Path\nprint(n, Path('a.ipynb').exists())"), tmp_path / "run" / "b.ipynb"
    assert notebooks.run(path, target, {"n": 7}) is None
    cells = nbformat.read(target, as_version=4).cells
    assert cells[-1].outputs[0].text == "7 True\n"
    assert str(tmp_path) not in target.read_text()
    assert [file.name for file in target.parent.iterdir()] == ["b.ipynb"]


def test_what_fails_is_kept_and_said_in_a_line(made, tmp_path):
    said = notebooks.run(made("1 / 0"), tmp_path / "b.ipynb", {})
    assert said == "failed in cell 2: ZeroDivisionError: division by zero"
    assert (tmp_path / "b.ipynb").exists()


def test_a_cells_outputs_may_be_left_out_of_what_is_stored(made, tmp_path):
    run, target = tmp_path / "b.ipynb", tmp_path / "c.ipynb"
    assert notebooks.run(made("print(n)", [notebooks.UNSTORED]), run, {}) is None
    notebooks.store(run, target)
    assert nbformat.read(run, as_version=4).cells[-1].outputs
    assert nbformat.read(target, as_version=4).cells[-1].outputs == []


def test_a_widget_beside_which_there_is_html_is_not_stored(made, tmp_path):
    run, target = tmp_path / "b.ipynb", tmp_path / "c.ipynb"
    code = "import ipywidgets\nfrom IPython.display import display\none, two = ipywidgets.Label(), ipywidgets.Label()\n"
    code += "display({'text/html': '<p>one</p>', **one._repr_mimebundle_()}, raw=True)\ntwo"
    assert notebooks.run(made(code), run, {}) is None
    notebooks.store(run, target)

    def held(path):
        notebook = nbformat.read(path, as_version=4)
        states = notebook.metadata["widgets"][notebooks.STATES]["state"]
        models = [output.data.get(WIDGET, {}).get("model_id") for output in notebook.cells[-1].outputs]
        return models, [model in states for model in models], notebook.cells[-1].outputs[0].data["text/html"]

    (one, two), stated, html = held(run)
    assert stated == [True, True]
    assert held(target) == ([None, two], [False, True], html)
    assert one not in target.read_text()
