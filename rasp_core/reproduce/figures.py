"""Figures with facts: notebooks save them here, and `rasp figures` runs the notebooks and holds the facts to account.

A figure NN_name is paper_figures/NN_name.png, .pdf and .json (its facts, raw). NN_name.expected.json says for each
scale what a fact must be: `value` with `tolerance`, `at_least`, `at_most` or `equals`; its unit, source and status.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..io.atomic_files import whole
from ..util.errors import InputError
from .provenance import sources

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

    from ..geometry.meshes import Body

ROOT = Path(__file__).resolve().parents[2]
STATUSES = ("reproduced", "exceeded", "differs", "not verifiable")


@dataclass(frozen=True)
class Verdict:
    """One fact of a figure beside what was expected of it."""

    figure: str
    fact: str
    found: object
    expected: str
    holds: bool
    status: str


def save(
    name: str,
    figure: Figure,
    facts: dict,
    out: str | Path,
    scene: tuple[Sequence[Body], np.ndarray] | None = None,
) -> Path:
    """Write a figure's PNG, PDF and facts into `out`; returns the PNG's path, for the notebook to show.

    facts : plain numbers, strings and booleans; versions, and what the figure was made from (`provenance`), are added.
    scene : bodies and their poses `(N, 4, 4)` for NAME.glb, which the gallery's page turns. Each file appears whole or
    not at all.
    """
    from ..api.run_folder import versions
    from ..visualize.gltf import encode

    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    for suffix, metadata in ((".png", {"Software": None}), (".pdf", {"CreationDate": None})):
        with whole(out / f"{name}{suffix}") as part:
            figure.savefig(part, dpi=130, metadata=metadata, format=suffix[1:])
    if scene is not None:
        with whole(out / f"{name}.glb") as part:
            part.write_bytes(encode(*scene))
    made, notebook = {"versions": versions()}, ROOT / "notebooks" / f"{name}.ipynb"
    if notebook.is_file():  # figures of the user's own have none
        made["sources"] = sources(notebook, ROOT)
    _write(out / f"{name}.json", {**facts, **made})
    return out / f"{name}.png"


def _write(path: Path, facts: dict) -> None:
    with whole(path) as part:
        part.write_text(json.dumps(facts, indent=1) + "\n")


def compare(name: str, facts: dict, expected: dict) -> list[Verdict]:
    """Hold a figure's facts against what is expected of them. A fact that is missing does not hold.

    Raises InputError where an expectation has no bound, or a status that is not one of STATUSES.
    """
    verdicts = []
    for fact, wanted in expected.items():
        if wanted.get("status") not in STATUSES:
            raise InputError(f"{name}: fact {fact} has status {wanted.get('status')!r}; use {', '.join(STATUSES)}")
        found = facts.get(fact)
        verdicts.append(Verdict(name, fact, found, _bound(name, fact, wanted), _holds(found, wanted), wanted["status"]))
    return verdicts


def _bound(name: str, fact: str, wanted: dict) -> str:
    if "value" in wanted:
        return f"{wanted['value']:.6g} ± {wanted['tolerance']:.2g}"
    for key, sign in (("at_least", "≥"), ("at_most", "≤"), ("equals", "=")):
        if key in wanted:
            return f"{sign} {wanted[key]}"
    raise InputError(f"{name}: fact {fact} has no bound; give value and tolerance, at_least, at_most or equals")


def _holds(found, wanted: dict) -> bool:
    if found is None:
        return False
    if "value" in wanted:
        return abs(found - wanted["value"]) <= wanted["tolerance"]
    if "at_least" in wanted:
        return found >= wanted["at_least"]
    return found <= wanted["at_most"] if "at_most" in wanted else found == wanted["equals"]


def run(names: Sequence[str] = (), scale: str = "quick", store: bool = False, root: Path = ROOT) -> int:
    """Run figure notebooks with papermill and compare their facts; 0 where all hold, else 1.

    scale : "quick" writes into paper_figures/, "paper" into paper_figures/paper/. store : keep the executed notebooks
    with their outputs in notebooks/ (only at quick scale), instead of in out/. The seconds that each took are added to
    its facts.
    Raises InputError for a name without a notebook, or where the kit is installed without its notebooks.
    """
    if store and scale != "quick":
        raise InputError("notebooks are stored at quick scale; leave out --store or use --scale quick")
    found = {path.stem: path for path in sorted((root / "notebooks").glob("[0-9][0-9]_*.ipynb"))}
    if not found:
        raise InputError(f"{root / 'notebooks'}: no notebooks there; run from a clone of the repository")
    unknown = [name for name in names if name not in found]
    if unknown:
        raise InputError(f"no figure named {', '.join(unknown)}; there are {', '.join(found)}")
    out = root / "paper_figures" / ("" if scale == "quick" else scale)
    verdicts: list[Verdict] = []
    for name in names or found:
        began = time.monotonic()
        failure = _execute(found[name], scale, out, store, root)
        seconds = time.monotonic() - began
        print(f"{name}: {failure or 'ran'} in {seconds:.0f} s", file=sys.stderr)
        if failure:
            verdicts.append(Verdict(name, "notebook runs", failure, "without error", False, "differs"))
            continue
        expected = root / "paper_figures" / f"{name}.expected.json"
        if expected.exists():
            facts = json.loads((out / f"{name}.json").read_text()) | {"seconds": seconds}
            _write(out / f"{name}.json", facts)
            verdicts += compare(name, facts, json.loads(expected.read_text())[scale])
    print(table(verdicts))
    return 0 if all(verdict.holds for verdict in verdicts) else 1


def table(verdicts: Sequence[Verdict]) -> str:
    """The verdicts as lines of text, one for each fact."""
    rows = [("figure", "fact", "found", "expected", "holds", "status")]
    for v in verdicts:
        found = f"{v.found:.6g}" if isinstance(v.found, float) else str(v.found)
        rows.append((v.figure, v.fact, found, v.expected, "yes" if v.holds else "NO", v.status))
    widths = [max(len(row[k]) for row in rows) for k in range(6)]
    return "\n".join("  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in rows)


def _execute(path: Path, scale: str, out: Path, store: bool, root: Path) -> str | None:
    """Run one notebook; None, or in one line how it failed."""
    import papermill
    from nbclient.exceptions import DeadKernelError

    target = path if store else root / "out" / "notebooks" / scale / path.name
    target.parent.mkdir(parents=True, exist_ok=True)
    out.mkdir(parents=True, exist_ok=True)
    part = target.with_name(f".{target.name}.part.ipynb")
    parameters = {} if scale == "quick" else {"scale": scale, "out": os.path.relpath(out, path.parent)}
    try:
        papermill.execute_notebook(
            str(path),
            str(part),
            parameters,
            cwd=str(path.parent),
            progress_bar=False,
            kernel_name="python3",
            language="python",
        )
    except papermill.exceptions.PapermillExecutionError as error:
        os.replace(part, target)
        return f"failed in cell {error.exec_count}: {error.ename}: {' '.join(str(error.evalue).split())[:200]}"
    except DeadKernelError:
        part.unlink(missing_ok=True)
        return "failed: its Python process died"
    _forget_places(part)
    os.replace(part, target)
    return None


def _forget_places(path: Path) -> None:
    """Take papermill's notes of folders and times out of a notebook: a run elsewhere stores the same."""
    import nbformat

    notebook = nbformat.read(path, as_version=4)
    for part in (notebook, *notebook.cells):
        part.metadata.pop("papermill", None)
    nbformat.write(notebook, path)
