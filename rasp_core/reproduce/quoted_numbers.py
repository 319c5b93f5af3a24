"""Measured numbers in prose: links to the facts that they are, written by the facts.

`[17 %](paper_figures/05_loss_ablation.json "overlap, L_sil")` is that fact in per cent, with no decimals. `make
gallery` writes the numbers anew, in pages and in the notebooks' text; the link's own text says how many decimals, and
in which unit.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import nbformat

from ..io.atomic_files import whole
from ..util.errors import InputError

QUOTED = re.compile(r'\[\d+(?:\.(\d+))?( ?%| mm)?\](\(([^()\s]+\.json)\s+"([^"]+)"\))')
UNITS = {"": 1.0, "%": 100.0, "mm": 1000.0}  # facts are shares, metres and plain numbers


def refresh(path: str | Path) -> None:
    """Write the quoted numbers of a Markdown file or a notebook anew. Raises InputError as `quoted` does."""
    path = Path(path)
    text = quoted(path)
    if text != path.read_text(encoding="utf-8"):
        with whole(path) as part:
            part.write_text(text, encoding="utf-8")


def pages(root: str | Path) -> list[Path]:
    """The files of the repository at `root` whose prose may quote numbers."""
    root = Path(root)
    return [root / "README.md", root / "REPRODUCING.md", *sorted((root / "notebooks").glob("*.ipynb"))]


def quoted(path: Path) -> str:
    """The text of a Markdown file, or of a notebook, with its quoted numbers as the facts have them; links are relative
    to the file.

    Raises InputError naming the file where a fact is not there, or is no number.
    """

    def number(found: re.Match) -> str:
        decimals, unit, link, facts, fact = found.groups()
        try:
            value = json.loads((path.parent / facts).read_text(encoding="utf-8"))[" ".join(fact.split())]
            shown = f"{value * UNITS[(unit or '').strip()]:.{len(decimals or '')}f}{unit or ''}"
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(f"{path}: quotes {fact!r} of {facts}, where no such number is; mend the link") from error
        return f"[{shown}]{link}"

    if path.suffix != ".ipynb":
        return QUOTED.sub(number, path.read_text(encoding="utf-8"))
    notebook = nbformat.read(path, as_version=4)
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            cell.source = QUOTED.sub(number, cell.source)
    return nbformat.writes(notebook) + "\n"
