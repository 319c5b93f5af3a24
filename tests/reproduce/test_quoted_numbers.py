"""Numbers in prose are the facts that they quote."""

import json
from pathlib import Path

import nbformat
import pytest

from rasp_core.reproduce import quoted_numbers
from rasp_core.util.errors import InputError

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def page(tmp_path):
    """A way to write a page beside one file of facts."""
    (tmp_path / "facts.json").write_text(json.dumps({"share": 0.17304, "gap, mean": 0.0124, "count": 4, "word": "a"}))

    def write(text):
        path = tmp_path / "page.md"
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ('[9 %](facts.json "share")', '[17 %](facts.json "share")'),
        ('[9.00](facts.json "share")', '[0.17](facts.json "share")'),
        ('[9.0 mm](facts.json "gap, mean")', '[12.4 mm](facts.json "gap, mean")'),
        ('[9](facts.json "count") of 5', '[4](facts.json "count") of 5'),
        ('[9](facts.json\n"gap,\nmean")', '[0](facts.json\n"gap,\nmean")'),
        ('[nine](facts.json "share"), [9](facts.json)', '[nine](facts.json "share"), [9](facts.json)'),
    ],
)
def test_a_quoted_number_is_its_fact(page, before, after):
    path = page(before)
    quoted_numbers.refresh(path)
    assert path.read_text() == after


@pytest.mark.parametrize("link", ['facts.json "none"', 'facts.json "word"', 'none.json "share"'])
def test_what_is_no_fact_is_named(page, link):
    with pytest.raises(InputError, match="where no such number is"):
        quoted_numbers.refresh(page(f"[9]({link})"))


def test_in_notebooks_the_text_is_written_anew_and_nothing_else(page, tmp_path):
    page("")
    code = nbformat.v4.new_code_cell(
        "print(1)", outputs=[nbformat.v4.new_output("stream", text='[9](facts.json "count")')]
    )
    words = nbformat.v4.new_markdown_cell('Of 5 [9](facts.json "count").')
    notebook = nbformat.v4.new_notebook(cells=[words, code])
    nbformat.write(notebook, tmp_path / "a.ipynb")
    quoted_numbers.refresh(tmp_path / "a.ipynb")
    words.source = 'Of 5 [4](facts.json "count").'
    assert nbformat.read(tmp_path / "a.ipynb", as_version=4) == notebook


@pytest.mark.parametrize("path", quoted_numbers.pages(ROOT), ids=lambda path: path.name)
def test_no_number_in_the_committed_prose_differs_from_its_fact(path):
    assert quoted_numbers.quoted(path) == path.read_text(encoding="utf-8"), "run make gallery"


def test_numbers_are_quoted():
    assert len(quoted_numbers.QUOTED.findall((ROOT / "REPRODUCING.md").read_text())) > 20
    cells = nbformat.read(ROOT / "notebooks" / "03_packing_density.ipynb", as_version=4).cells
    assert len(quoted_numbers.QUOTED.findall("".join(cell.source for cell in cells))) > 2
