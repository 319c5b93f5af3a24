"""Figures with facts: notebooks save them here, and `rasp figures` runs the notebooks and holds the facts to account.

A figure NN_name, or from_scratch, is NN_name.png, .pdf and .json (its facts, raw): made in out/figures, stored in
paper_figures. NN_name.expected.json there says for each scale what a fact must be: `value` with `tolerance`,
`at_least`, `at_most` or `equals`; its unit, source and status.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import shutil
import sys
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..io.atomic_files import whole
from ..util.errors import InputError
from ..visualize import style
from .provenance import sources
from .quoted_numbers import refresh

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

    from ..geometry.meshes import Body

ROOT = Path(__file__).resolve().parents[2]
LARGE_BYTES = 200_000  # of a picture, above which it is in fewer colours: all are kept in the repository
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

    facts : plain numbers, strings and booleans; versions, what the figure was made from (`provenance`), and how small
    its text becomes at a third of its size are added, the last with a warning if it cannot be read there.
    scene : bodies and their poses `(N, 4, 4)` for NAME.glb, which the gallery's page turns. Each file appears whole or
    not at all.
    """
    from ..api.run_folder import versions
    from ..visualize.gltf import encode

    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    with whole(out / f"{name}.png") as part:
        part.write_bytes(_small(figure, dpi=style.DPI, bbox_inches="tight"))
    with whole(out / f"{name}.pdf") as part:
        figure.savefig(part, dpi=style.DPI, bbox_inches="tight", metadata={"CreationDate": None}, format="pdf")
    if scene is not None:
        with whole(out / f"{name}.glb") as part:
            part.write_bytes(encode(*scene))
    made, notebook = {"versions": versions()}, ROOT / "notebooks" / f"{name}.ipynb"
    text = style.pixels_at_a_third(figure)
    if text < style.LEGIBLE_PX:
        small = f"{name}: text of {text:.1f} pixels at a third of the figure's size; {style.LEGIBLE_PX:.0f} can be read"
        warnings.warn(f"{small}, which are {style.TEXT_PT} pt", stacklevel=2)
    if math.isfinite(text):
        made["text, pixels at a third of the size"] = round(text, 1)
    if notebook.is_file():  # figures of the user's own have none
        made["sources"] = sources(notebook, ROOT)
    _write(out / f"{name}.json", {**facts, **made})
    return out / f"{name}.png"


def runs_folder(name: str, out: str | Path) -> Path:
    """A folder in `out` for the runs that a figure is made of, so that its notebook goes on where it was interrupted.

    It is another one whenever what the figure is made from (`provenance`) has changed.
    """
    made = json.dumps(sources(ROOT / "notebooks" / f"{name}.ipynb", ROOT), sort_keys=True)
    return Path(out) / "runs" / f"{name}-{hashlib.sha256(made.encode()).hexdigest()[:12]}"


def inline() -> None:
    """Have the notebook that calls this show figures in one style, as PNGs in few colours, as `save` writes them."""
    from IPython import get_ipython
    from matplotlib.figure import Figure

    style.use()
    shell, look = get_ipython(), {"bbox_inches": "tight", "dpi": style.SHOWN_DPI}
    if shell is not None:
        shell.display_formatter.formatters["image/png"].for_type(Figure, lambda figure: _small(figure, **look))


def shown(path: str | Path, wide: int = 950):
    """A figure's PNG as a notebook keeps it: `wide` pixels at most, and as a JPEG where that is smaller."""
    from IPython.display import Image as Shown
    from PIL import Image

    from ..io import palette

    with Image.open(path) as picture:
        picture = picture.convert("RGB")
    if picture.width > wide:
        picture = picture.resize((wide, round(picture.height * wide / picture.width)), Image.Resampling.LANCZOS)
    jpeg = io.BytesIO()
    picture.save(jpeg, "JPEG", quality=82, optimize=True)
    import numpy as np

    return Shown(data=min(jpeg.getvalue(), palette.png(np.asarray(picture)), key=len))


def _small(figure: Figure, **options) -> bytes:
    """A PNG in few colours. options : of `savefig`."""
    import numpy as np
    from PIL import Image

    from ..io import palette

    data = io.BytesIO()
    figure.savefig(data, format="png", **options)
    return palette.png(np.asarray(Image.open(data).convert("RGB")), LARGE_BYTES)


def _write(path: Path, facts: dict) -> None:
    with whole(path) as part:
        part.write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")


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
    """Run figure notebooks and compare their facts with those expected; 0 where all hold, else 1.

    scale : "quick" or "paper", on the real pools. Figures and facts, with the seconds that each took, come into
    out/figures/SCALE, executed notebooks into out/notebooks/SCALE. store : keep them too, in paper_figures/ (paper's in
    paper_figures/paper/) but for what .gitignore names there, and in notebooks/ (quick's alone).
    Raises InputError for a name without a notebook, or where the kit is installed without its notebooks.
    """
    folder = root / "notebooks"  # from_scratch is number zero of the reading order
    paths = [*folder.glob("from_scratch.ipynb"), *sorted(folder.glob("[0-9][0-9]_*.ipynb"))]
    found = {path.stem: path for path in paths}
    if not found:
        raise InputError(f"{folder}: no notebooks there; run from a clone of the repository")
    unknown = [name for name in names if name not in found]
    if unknown:
        raise InputError(f"no figure named {', '.join(unknown)}; there are {', '.join(found)}")
    from . import notebooks

    out = root / "out" / "figures" / scale
    parameters = {} if scale == "quick" else {"scale": scale, "out": f"../out/figures/{scale}"}
    verdicts: list[Verdict] = []
    for name in names or found:
        executed, began = root / "out" / "notebooks" / scale / f"{name}.ipynb", time.monotonic()
        for old in out.glob(f"{name}.*"):
            old.unlink()
        failure = notebooks.run(found[name], executed, parameters)
        seconds = time.monotonic() - began
        print(f"{name}: {failure or 'ran'} in {seconds:.0f} s", file=sys.stderr)
        if failure:
            verdicts.append(Verdict(name, "notebook runs", failure, "without error", False, "differs"))
            continue
        expected = root / "paper_figures" / f"{name}.expected.json"
        if expected.exists():
            facts = json.loads((out / f"{name}.json").read_text(encoding="utf-8")) | {"seconds": seconds}
            _write(out / f"{name}.json", facts)
            verdicts += compare(name, facts, json.loads(expected.read_text(encoding="utf-8"))[scale])
        if store:
            if scale == "quick":
                notebooks.store(executed, found[name])
            _store(sorted(out.glob(f"{name}.*")), scale, root)
            refresh(found[name])
    print(table(verdicts))
    return 0 if all(verdict.holds for verdict in verdicts) else 1


def _store(made: Sequence[Path], scale: str, root: Path) -> None:
    """Copy files into paper_figures, but for those that .gitignore names there."""
    folder = root / "paper_figures" / ("" if scale == "quick" else scale)
    folder.mkdir(parents=True, exist_ok=True)
    ignore = root / ".gitignore"
    patterns = ignore.read_text(encoding="utf-8").splitlines() if ignore.exists() else []
    for path in made:
        target = folder / path.name
        if not any(p.startswith("/paper_figures/") and target.relative_to(root).match(p[1:]) for p in patterns):
            with whole(target) as part:
                shutil.copyfile(path, part)


def table(verdicts: Sequence[Verdict]) -> str:
    """The verdicts as lines of text, one for each fact."""
    rows = [("figure", "fact", "found", "expected", "holds", "status")]
    for v in verdicts:
        found = f"{v.found:.6g}" if isinstance(v.found, float) else str(v.found)
        rows.append((v.figure, v.fact, found, v.expected, "yes" if v.holds else "NO", v.status))
    widths = [max(len(row[k]) for row in rows) for k in range(6)]
    return "\n".join("  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in rows)
