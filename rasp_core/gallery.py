"""The gallery: each figure and number of the paper beside what was measured, by the notebooks' facts."""

from __future__ import annotations

import json
from pathlib import Path

from .errors import InputError
from .figures import STATUSES, compare

HEAD = """# Gallery

What the paper shows or says, and what the kit's notebooks measured. Generated from `claims.json`, the facts
`NN_name.json` and what is expected of them, `NN_name.expected.json`, by `make gallery`; nobody types a measured number.
`quick` runs on data that the kit makes itself, `paper` on the real pools ([how to run each](../REPRODUCING.md)).

| figure | the paper | says | measured | expected | status | scale | command |
|---|---|---|---|---|---|---|---|
"""


def write(folder: str | Path) -> Path:
    """Write `README.md` into the folder of the figures. Raises InputError as `page` does."""
    path = Path(folder) / "README.md"
    text = page(Path(folder))
    part = path.with_suffix(".part")
    part.write_text(text)
    part.replace(path)
    return path


def page(folder: Path) -> str:
    """The gallery as Markdown. Raises InputError for a claim without a status, or whose fact is not there."""
    claims = json.loads((folder / "claims.json").read_text())
    return HEAD + "".join(_row(folder, claim) for claim in claims)


def _row(folder: Path, claim: dict) -> str:
    scale, name = claim.get("scale", "quick"), claim.get("figure")
    picture = measured = bound = ""
    command, status = claim.get("command"), claim.get("status")
    if name is not None:
        base = folder if scale == "quick" else folder / scale
        facts = json.loads((base / f"{name}.json").read_text())
        expected = json.loads((folder / f"{name}.expected.json").read_text())[scale]
        fact = claim["fact"]
        if fact not in facts or fact not in expected:
            raise InputError(f"claims.json: {claim['of']}: {name} has no fact {fact!r} at scale {scale}; mend it")
        (verdict,) = compare(name, facts, {fact: expected[fact]})
        status, unit = verdict.status, expected[fact]["unit"]
        if not verdict.holds:
            status, claim = "differs", {**claim, "reason": "the last run did not come to what is expected"}
        measured, bound = f"{fact}: **{_said(facts[fact], unit)}**", _bound(expected[fact], unit)
        option = "" if scale == "quick" else f" --scale {scale}"
        command = f"rasp figures {name}{option}"
        picture = f"[<img src='{base.relative_to(folder) / name}.png' width='160'>](../notebooks/{name}.ipynb)"
    if status not in STATUSES or not command:
        raise InputError(f"claims.json: {claim['of']}: needs a command and a status, one of {', '.join(STATUSES)}")
    if status == "differs" and not claim.get("reason"):
        raise InputError(f"claims.json: {claim['of']}: differs, so it needs a reason")
    status = status + (f": {claim['reason']}" if claim.get("reason") else "")
    cells = picture, claim["of"], claim["says"], measured, bound, status, scale, f"`{command}`"
    return "| " + " | ".join(cells) + " |\n"


def _said(value, unit: str) -> str:
    """A fact in words; bare numbers have the unit 1, and booleans none."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    shown = f"{value:.3g}" if isinstance(value, float) else str(value)
    return shown if unit in ("1", "boolean") else f"{shown} {unit}"


def _bound(wanted: dict, unit: str) -> str:
    for key, sign in (("equals", ""), ("at_least", "≥ "), ("at_most", "≤ ")):
        if key in wanted:
            return sign + _said(wanted[key], unit)
    return f"{_said(wanted['value'], unit)} ± {wanted['tolerance']:.2g}"
