"""The committed gallery is the one that its facts make; claims without proof are refused."""

import base64
import io
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from rasp_core.reproduce import gallery
from rasp_core.reproduce.figures import STATUSES
from rasp_core.util.errors import InputError

FIGURES = Path(__file__).resolve().parents[2] / "paper_figures"


@pytest.fixture
def folder(tmp_path):
    """A copy of the facts, with one claim."""
    for path in FIGURES.glob("00_quickstart*.json"):
        shutil.copy(path, tmp_path)
    return tmp_path


def claim(folder, **entries):
    (folder / "claims.json").write_text(json.dumps([{"of": "a figure", "says": "something", **entries}]))


def test_the_committed_gallery_says_what_the_facts_say():
    """Seconds and last digits differ from machine to machine, so the rows are compared without what was measured."""

    def rows(text):
        return [[cell for k, cell in enumerate(line.split(" | ")) if k not in (3, 7)] for line in text.splitlines()]

    assert rows((FIGURES / "README.md").read_text()) == rows(gallery.page(FIGURES))


def test_every_row_has_a_status_a_command_and_every_figure_a_row():
    rows = [line.split(" | ") for line in gallery.page(FIGURES).splitlines() if line.startswith("| ") and "`" in line]
    rows = [row for row in rows if len(row) == 9]
    claims = json.loads((FIGURES / "claims.json").read_text())
    assert len(rows) == len(claims)
    for row in rows:
        assert row[5].split(":")[0] in STATUSES
        assert row[8].strip(" |").startswith("`")
    shown = {entry.get("figure") for entry in claims}
    assert {path.name.split(".")[0] for path in FIGURES.glob("*.expected.json")} <= shown


def test_a_row_says_the_fact_with_its_unit(folder):
    claim(folder, figure="00_quickstart", fact="certified")
    assert "certified: **yes**" in gallery.write(folder).read_text()
    claim(folder, figure="00_quickstart", fact="density")
    facts = json.loads((folder / "00_quickstart.json").read_text())
    assert f"density: **{facts['density']:.3g}** | ≥ 0.35 | reproduced" in gallery.page(folder)


def test_a_fact_that_does_not_hold_is_said_to_differ(folder):
    facts = json.loads((folder / "00_quickstart.json").read_text())
    (folder / "00_quickstart.json").write_text(json.dumps(facts | {"density": 0.1}))
    claim(folder, figure="00_quickstart", fact="density")
    assert "density: **0.1** | ≥ 0.35 | differs: the last run did not come to what is expected" in gallery.page(folder)


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ({"figure": "00_quickstart", "fact": "colour"}, "has no fact 'colour' at scale quick"),
        ({"status": "not verifiable"}, "needs a command and a status"),
        ({"status": "fine", "command": "make"}, "needs a command and a status"),
        ({"status": "differs", "command": "make"}, "differs, so it needs a reason"),
    ],
)
def test_claims_without_proof(folder, entries, message):
    claim(folder, **entries)
    with pytest.raises(InputError, match=message):
        gallery.page(folder)


def test_the_page_holds_its_pictures_and_scenes(tmp_path):
    from PIL import Image

    from data_fetch import kitchen_like
    from rasp_core.visualize.gltf import encode

    shutil.copy(FIGURES / "00_quickstart.json", tmp_path)
    shutil.copy(FIGURES / "00_quickstart.expected.json", tmp_path)
    Image.new("RGB", (900, 300), "white").save(tmp_path / "00_quickstart.png")
    bodies = kitchen_like(2)
    (tmp_path / "00_quickstart.glb").write_bytes(encode(bodies, np.tile(np.eye(4), (2, 1, 1))))
    claim(tmp_path, figure="00_quickstart", fact="certified", reason="a < b")
    text = gallery.write_html(tmp_path, tmp_path / "out" / "gallery.html").read_text()
    assert "certified: <b>yes</b>" in text
    assert "a &lt; b" in text
    assert text.count("<iframe") == 1
    picture = re.search(r"src='data:image/jpeg;base64,([^']+)'", text).group(1)
    assert Image.open(io.BytesIO(base64.b64decode(picture))).size == (480, 160)
    assert not re.search(r"(src|href)=['\"](?!data:)", text), "nothing is loaded from elsewhere"
