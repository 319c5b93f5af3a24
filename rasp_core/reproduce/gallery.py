"""The gallery: each figure and number of the paper beside what was measured, by the notebooks' facts."""

from __future__ import annotations

import base64
import io
import json
import re
from dataclasses import dataclass
from html import escape
from pathlib import Path

from ..io.atomic_files import whole
from ..util.errors import InputError
from .figures import STATUSES, compare

LEAD = """What the paper shows or says, and what the kit's notebooks measured. Generated from `claims.json`, the facts
`NN_name.json` and what is expected of them, `NN_name.expected.json`, by `make gallery`; nobody types a measured number.
`quick` runs on data that the kit makes itself, `paper` on the real pools."""
COLUMNS = ("figure", "the paper", "says", "measured", "expected", "status", "scale", "seconds", "command")
THUMBNAIL = 480  # pixels
STYLE = """body{font:15px/1.4 system-ui,sans-serif;margin:2em auto;max-width:1400px;padding:0 1em}
table{border-collapse:collapse}td,th{border-bottom:1px solid #ddd;padding:.5em;vertical-align:top;text-align:left}
img{width:240px}iframe{width:440px;height:330px;border:1px solid #ddd}figure{display:inline-block;margin:.5em}
.differs{color:#a40}.exceeded,.reproduced{color:#063}code{font-size:90%}"""


@dataclass(frozen=True)
class Row:
    """One claim of the paper beside its fact; picture : of the figure's PNG, None where there is none."""

    picture: Path | None
    of: str
    says: str
    fact: str
    found: str
    expected: str
    status: str
    reason: str
    scale: str
    seconds: str
    command: str


def write(folder: str | Path) -> Path:
    """Write `README.md` into the folder of the figures. Raises InputError as `rows` does."""
    return _write(Path(folder) / "README.md", page(Path(folder)))


def write_html(folder: str | Path, path: str | Path) -> Path:
    """Write the gallery as one HTML page that holds all that it shows. Raises InputError as `rows` does."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    return _write(path, html_page(Path(folder)))


def rows(folder: Path) -> list[Row]:
    """The claims and their facts. Raises InputError for a claim without a status, or whose fact is not there."""
    return [_row(folder, claim) for claim in json.loads((folder / "claims.json").read_text(encoding="utf-8"))]


def page(folder: Path) -> str:
    """The gallery as Markdown. Raises InputError as `rows` does."""
    lines = [f"# Gallery\n\n{LEAD} [How to run each](../REPRODUCING.md).\n"]
    lines += ["| " + " | ".join(COLUMNS) + " |", "|---" * len(COLUMNS) + "|"]
    for row in rows(folder):
        picture = ""
        if row.picture is not None:
            image = row.picture.relative_to(folder).as_posix()
            picture = f"[<img src='{image}' width='160'>](../notebooks/{row.picture.stem}.ipynb)"
        status = row.status + (f": {row.reason}" if row.reason else "")
        measured = f"{row.fact}: **{row.found}**" if row.fact else ""
        cells = picture, row.of, row.says, measured, row.expected, status, row.scale, row.seconds
        cells = *cells, f"`{row.command}`"
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def html_page(folder: Path) -> str:
    """The gallery as a page without links to other files: pictures, and scenes that are turned with the mouse.

    Raises InputError as `rows` does.
    """
    from ..visualize.gltf import page_of

    scenes = "".join(
        f"<figure><iframe loading='lazy' srcdoc='{escape(page_of(path.read_bytes()))}'></iframe>"
        f"<figcaption>{escape(path.stem)}</figcaption></figure>\n"
        for path in sorted(folder.glob("*.glb"))
    )
    head = "".join(f"<th>{name}</th>" for name in COLUMNS)
    lines = []
    for row in rows(folder):
        picture = "" if row.picture is None else f"<img alt='{escape(row.of)}' src='{_thumbnail(row.picture)}'>"
        reason = f": {escape(row.reason)}" if row.reason else ""
        status = f"<span class='{row.status.split()[0]}'>{row.status}</span>{reason}"
        measured = f"{escape(row.fact)}: <b>{escape(row.found)}</b>" if row.fact else ""
        cells = picture, escape(row.of), escape(row.says), measured, escape(row.expected), status, row.scale
        cells = *cells, row.seconds, f"<code>{escape(row.command)}</code>"
        lines.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>\n")
    lead = re.sub("`([^`]+)`", r"<code>\1</code>", escape(LEAD))
    return (
        f"<!doctype html><html lang='en'><head><meta charset='utf-8'><title>The RASP kit's gallery</title>"
        f"<style>{STYLE}</style></head><body><h1>Gallery</h1><p>{lead}</p><h2>Turn them with the mouse</h2>\n"
        f"{scenes}<h2>Each claim of the paper</h2><table><tr>{head}</tr>\n{''.join(lines)}</table></body></html>\n"
    )


def _row(folder: Path, claim: dict) -> Row:
    scale, name = claim.get("scale", "quick"), claim.get("figure")
    command, status, reason = claim.get("command"), claim.get("status"), claim.get("reason", "")
    picture, fact, found, bound, seconds = None, "", "", "", ""
    if name is not None:
        base = folder if scale == "quick" else folder / scale
        facts = json.loads((base / f"{name}.json").read_text(encoding="utf-8"))
        expected = json.loads((folder / f"{name}.expected.json").read_text(encoding="utf-8"))[scale]
        fact = claim["fact"]
        if fact not in facts or fact not in expected:
            raise InputError(f"claims.json: {claim['of']}: {name} has no fact {fact!r} at scale {scale}; mend it")
        (verdict,) = compare(name, facts, {fact: expected[fact]})
        status, unit = verdict.status, expected[fact]["unit"]
        if not verdict.holds:
            status, reason = "differs", "the last run did not come to what is expected"
        seconds = f"{facts['seconds']:.0f}" if "seconds" in facts else ""
        found, bound = _said(facts[fact], unit), _bound(expected[fact], unit)
        command = f"rasp figures {name}" + ("" if scale == "quick" else f" --scale {scale}")
        picture, scale = base / f"{name}.png", f"{scale}: {facts['data']}" if "data" in facts else scale
    if status not in STATUSES or not command:
        raise InputError(f"claims.json: {claim['of']}: needs a command and a status, one of {', '.join(STATUSES)}")
    if status == "differs" and not reason:
        raise InputError(f"claims.json: {claim['of']}: differs, so it needs a reason")
    return Row(picture, claim["of"], claim["says"], fact, found, bound, status, reason, scale, seconds, command)


def _write(path: Path, text: str) -> Path:
    with whole(path) as part:
        part.write_text(text, encoding="utf-8")
    return path


def _thumbnail(path: Path) -> str:
    """A picture, made smaller, as a link that holds it."""
    from PIL import Image

    data = io.BytesIO()
    with Image.open(path) as image:
        small = image.convert("RGB")
        small.thumbnail((THUMBNAIL, THUMBNAIL))
        small.save(data, "JPEG", quality=85)
    return f"data:image/jpeg;base64,{base64.b64encode(data.getvalue()).decode()}"


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
