"""Several boxes at the door, and what is written of them."""

import csv
import json
from itertools import chain

import pytest

import rasp_core as rasp
from data_fetch import kitchen_like
from rasp_core.api.run_folder import boxes_of
from rasp_core.exact.certificate import certify
from rasp_core.geometry.items import Item
from rasp_core.util.errors import InputError

BOX = rasp.box(0.15, 0.15, 0.12)


@pytest.fixture(scope="module")
def found():
    items = [Item(body, must=i == 7) for i, body in enumerate(kitchen_like(8))]
    return rasp.pack_boxes(items, BOX, "spectral", clearance=0.001, resolution=32, separable=True)


def test_every_part_is_in_one_box_and_each_box_holds(found):
    names = [body.name for packed in found for body in packed.bodies]
    assert sorted(names) == sorted(body.name for body in kitchen_like(8))
    assert sorted(chain(*(packed.chosen for packed in found))) == list(range(8))
    for packed in found:
        assert certify(packed.bodies, packed.matrices, BOX).holds
        assert packed.certificate.gaps.holds
        assert packed.missing == []
        assert packed.dismantling.holds
    assert kitchen_like(8)[7].name in [body.name for body in found[0].bodies], "what must go in goes into the first"
    assert found.certified
    assert found.separable
    assert sum("comes apart through the top" in line for line in found.lines()) == len(found)
    assert found.least == 1
    assert f"8 of 8 objects in {len(found)} boxes" in repr(found)
    volume = sum(body.volume for body in kitchen_like(8))
    assert found.density == pytest.approx(volume / len(found) / BOX.volume)


def test_each_box_is_a_run_and_the_summary_names_them(found, tmp_path):
    stale = tmp_path / "out" / "box_9"
    found.save(tmp_path / "out")
    found[0].save(stale)
    folder = found.save(tmp_path / "out", {"note": "kept"}, export="3mf")
    assert not stale.exists()
    summary = json.loads((folder / "boxes.json").read_text())
    assert [box["folder"] for box in summary["boxes"]] == [f"box_{k + 1}" for k in range(len(found))]
    assert (summary["least_by_volume"], summary["left"], summary["missing"]) == (1, [], [])
    with (folder / "boxes.csv").open() as file:
        rows = list(csv.DictReader(file))
    for number, packed in enumerate(found, 1):
        record = json.loads((folder / f"box_{number}" / "result.json").read_text())
        names = [entry["name"] for entry in record["objects"]]
        assert names == [row["name"] for row in rows if row["box"] == str(number)] == [b.name for b in packed.bodies]
        assert record["note"] == "kept"
        assert (folder / f"box_{number}" / "parts.3mf").exists()
    assert [run.name for run in boxes_of(folder)] == [f"box_{k + 1}" for k in range(len(found))]
    found[0].save(folder)
    assert not {"boxes.json", "boxes.csv", "box_1"} & {path.name for path in folder.iterdir()}, "one box now"
    found.save(folder)
    assert not (folder / "scene.glb").exists()
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        found.save(tmp_path / "file")


def test_what_is_left_over_is_named():
    items = [Item(body, must=True) for body in kitchen_like(8)]
    found = rasp.pack_boxes(items, BOX, "spectral", boxes=1, resolution=32)
    assert len(found) == 1
    assert found.missing == [body.name for body in found.left] != []
    assert len(found.left) + len(found[0].bodies) == 8


def test_boxes_of_several_kinds_are_filled_in_their_order(tmp_path):
    kinds = [(rasp.box(0.01, 0.2, 0.2), 2), (BOX, None)]
    found = rasp.pack_boxes(kitchen_like(8), kinds, "spectral", resolution=32)
    assert found.certified
    assert not found.left
    assert {packed.container for packed in found} == {BOX}, "nothing is as flat as the first"
    summary = json.loads((found.save(tmp_path / "out") / "boxes.json").read_text())
    assert summary["boxes"][0]["extent"] == [0.15, 0.15, 0.12]
    one = rasp.pack_boxes(kitchen_like(8), [(BOX, 1)], "spectral", resolution=32)
    assert (len(one), len(one.left)) == (1, 8 - len(one[0].bodies))
    alone = rasp.pack_boxes(kitchen_like(8), [kinds[0][0], BOX], "spectral", resolution=32)
    assert [packed.chosen for packed in alone] == [packed.chosen for packed in found], "the last as often as is needed"


@pytest.mark.parametrize(
    ("container", "options", "told"),
    [
        (BOX, {"boxes": 0}, "boxes must be 1 or more"),
        (BOX, {"count": 3}, "count is of one box"),
        (BOX, {"fixed": ["a"]}, "fixed is of one box"),
        ("auto", {}, "several boxes are of given kinds"),
        ([], {}, "several boxes are of given kinds"),
        ([(BOX, 0)], {}, "there are 1 or more, or None for as many as are needed, got 0"),
        (rasp.box(0.02, 0.02, 0.02), {"unit": "mm"}, "mm is larger than the container, 20 x 20 x 20 mm"),
    ],
)
def test_what_makes_no_sense_is_refused(container, options, told):
    with pytest.raises(InputError, match=told):
        rasp.pack_boxes(kitchen_like(2), container, "spectral", **options)
