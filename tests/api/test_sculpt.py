"""Art at the door: one heap, a row of heaps, painted, kept."""

import json

import numpy as np
import pytest
from PIL import Image

import rasp_core as rasp
from data_fetch import kitchen_like
from rasp_core.util.errors import InputError

QUICK = {"resolution": 64, "width": 0.5, "count": 12, "time_limit": 5.0}


@pytest.fixture(scope="module")
def row():
    return rasp.sculpt(kitchen_like(4), text=["LT", "TL"], **QUICK)


def test_words_of_two_letters_make_two_heaps(row, tmp_path):
    assert len(row) == 2
    assert repr(row).startswith("<2 sculptures: Sculpture of ")
    assert np.asarray(row.show()).shape == (400, 800, 3)
    assert [figure.__class__.__name__ for figure in row.plot()] == ["Figure", "Figure"]
    assert row._repr_html_().count("data:image") == 2
    folder = row.save(tmp_path / "row")
    assert sorted(path.name for path in folder.iterdir()) == ["1", "2"]
    record = json.loads((folder / "1" / "result.json").read_text())
    assert record["command"] == "art"
    assert (folder / "1" / "target_2.png").exists()


def test_one_heap_says_how_like_its_pictures_it_is(row):
    heap = row[0]
    assert heap.headline().endswith("; certified")
    assert "2 views, likeness" in repr(heap)
    assert [name for name in heap.table() if name.startswith("likeness ")]


def test_pictures_are_painted_and_shown(tmp_path):
    for name, colour in (("a", (200, 30, 30)), ("b", (30, 30, 200))):
        pixels = np.full((64, 64, 4), 0, np.uint8)
        pixels[16:48, 16:48] = (*colour, 255)
        Image.fromarray(pixels).save(tmp_path / f"{name}.png")
    heap = rasp.sculpt(kitchen_like(4), [tmp_path / "a.png", tmp_path / "b.png"], paint=True, **QUICK)
    folder = heap.save(tmp_path / "run", pictures=True)
    assert heap.painted.psnr.shape == (2,)
    assert {"painted.png", "installation.png", "turntable.gif", "heap.html"} <= {p.name for p in folder.iterdir()}
    assert json.loads((folder / "result.json").read_text())["ssim"] == heap.painted.ssim.tolist()
    assert "PSNR" in heap.table()["painted"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({}, "give one of them"),
        ({"text": ["A", "B"], "targets": ["a.png", "b.png"]}, "give one of them"),
        ({"text": ["A", "B"], "paint": True}, "letters have no colours"),
        ({"text": ["A", "B"], "resolution": 8}, "at least 32"),
        ({"text": ["A", "B"], "count": 0}, "at least one object, got a count of 0"),
        ({"text": ["A", "B"], "azimuths_deg": [0, 1, 2]}, "needs an azimuth and an elevation"),
    ],
)
def test_what_cannot_be_shown_is_refused(arguments, says):
    with pytest.raises(InputError, match=says):
        rasp.sculpt(kitchen_like(2), **arguments)


def test_pictures_give_way_where_asked(tmp_path):
    for name, low in (("a", 0), ("b", 6)):
        pixels = np.full((64, 64), 255, np.uint8)
        pixels[14 + low : 46 + low, 20:44] = 0
        Image.fromarray(pixels).save(tmp_path / f"{name}.png")
    heap = rasp.sculpt(kitchen_like(2), [tmp_path / "a.png", tmp_path / "b.png"], fit_targets=(0.1, 0, 0), **QUICK)
    assert heap.fitted.after.min() > heap.fitted.before.min() + 0.05
    assert heap.art.ceiling == pytest.approx(heap.fitted.after)
    assert heap.record()["fitted"]["ceiling"] == heap.fitted.after.tolist()
