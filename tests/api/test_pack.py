"""Packing at the door: any method, one result, and nothing that would be ignored."""

import json

import numpy as np
import pytest

import rasp_core as rasp
from data_fetch import kitchen_like
from rasp_core.exact.certificate import certify
from rasp_core.packing import dense
from rasp_core.problem import Settings
from rasp_core.util.errors import InputError

BOX = rasp.box(0.25, 0.25, 0.25)


@pytest.fixture(scope="module")
def packed():
    return rasp.pack(kitchen_like(6), BOX, method="dense", effort=2, seed=1)


def test_the_door_gives_what_the_method_finds(packed):
    alone = dense.pack(kitchen_like(6), BOX, settings=Settings(seed=1), effort=2)
    assert np.array_equal(packed.matrices, alone.arrangement.matrices)
    assert packed.chosen == alone.chosen
    assert packed.certificate == certify(packed.bodies, packed.matrices, BOX)


def test_it_says_what_it_is(packed):
    assert repr(packed) == f"<Packing 6 of 6 objects, density {packed.density:.3f}, certified>"
    html = packed._repr_html_()
    assert "dense" in html
    assert "6 of 6" in html
    assert "data:image" in html


def test_it_is_kept_as_a_runs_folder(packed, tmp_path):
    folder = packed.save(tmp_path / "run", {"note": "kept"})
    record = json.loads((folder / "result.json").read_text())
    assert record["method"] == "dense"
    assert record["note"] == "kept"
    assert record["density"] == pytest.approx(record["density_voxels"], rel=0.03)
    assert len(record["removal"]["order"]) == 6
    assert {path.name for path in folder.iterdir()} >= {"scene.glb", "history.csv", "silhouettes.png"}


def test_one_method_of_few_objects_settles(packed, tmp_path):
    settled = packed.settle()
    folder = packed.save(tmp_path / "run", settled=settled)
    assert (folder / "settled.glb").exists()
    assert "settled" in json.loads((folder / "result.json").read_text())


def test_a_recorded_packing_is_the_same_and_ends_where_it_lies(tmp_path):
    pool, quick = kitchen_like(5), {"count": 4, "iterations": 20, "resolution": 32, "query_points": 2000}
    alone, recorded = (rasp.pack(pool, BOX, record=record, viewing_volume=1.5, **quick) for record in (False, True))
    assert np.array_equal(alone.matrices, recorded.matrices)
    assert np.array_equal(alone.losses, recorded.losses)
    assert alone.recording is None
    shown = recorded.recording
    (run,) = shown.runs
    assert run.total == 20
    assert {body.name for body in shown.bodies} == {body.name for body in recorded.bodies}
    placed = dict(zip((body.name for body in shown.bodies), run.translation[-1], strict=True))
    for body, place in zip(recorded.bodies, recorded.poses.translation, strict=True):
        assert np.array_equal(placed[body.name], place)
    assert shown.cameras[0].width == 1.5 * 0.25
    assert {path.name for path in recorded.save(tmp_path / "run").iterdir()} >= {"run.html", "scene.glb"}
    assert not (alone.save(tmp_path / "alone") / "run.html").exists()


def test_a_recording_with_fixed_objects_is_refused():
    first, second = kitchen_like(2)
    with pytest.raises(InputError, match="leave one out"):
        rasp.pack([first], BOX, fixed=[second], record=True)


def test_what_may_not_be_turned_does_not_settle():
    packed = rasp.pack([rasp.Item(kitchen_like(1)[0], turns="z")], BOX, method="spectral")
    with pytest.raises(InputError, match="turns z are not kept by what falls; leave out --settle"):
        packed.settle()


def test_what_rests_on_others_is_not_said_to_keep_its_clearance():
    apart = rasp.pack(kitchen_like(2), BOX, method="spectral", clearance=0.02)
    assert apart.certificate.holds
    settled = apart.settle()
    assert settled.certificate.gaps.clearance == 0.02
    assert settled.certificate.gaps.least_to_wall.gap < 0.01, "it lies on the floor"
    assert not settled.certificate.holds
    assert "mm are asked" in settled.lines("mm")[-1]


@pytest.mark.parametrize(
    ("method", "settings", "says"),
    [
        ("dense", {"lambda_": 1.0}, "method dense does not use"),
        ("dense", {"iterations": 10}, "method dense does not use"),
        ("spectral", {"effort": 3}, "method spectral does not use"),
        ("paper", {"effort": 3}, "method paper does not use"),
        ("dense", {"count": 3}, "method dense does not use"),
        ("dense", {"record": True}, r"dense does not use record \(--record\); leave it out, or use --method paper"),
        ("paper", {"lamda": 3}, "pack has no setting lamda"),
        ("magic", {}, "unknown"),
    ],
)
def test_what_would_be_ignored_is_refused(method, settings, says):
    with pytest.raises(InputError, match=says):
        rasp.pack(kitchen_like(2), BOX, method=method, **settings)


@pytest.mark.parametrize("method", ["paper", "dense", "spectral", "heightmap"])
def test_every_method_gives_what_comes_apart(method):
    quick = {"paper": {"iterations": 20, "resolution": 32, "query_points": 2000}, "dense": {"effort": 2}}.get(
        method, {}
    )
    found = rasp.pack(kitchen_like(6), rasp.box(0.18, 0.18, 0.18), method, separable=True, **quick.get(method, {}))
    assert found.certificate.holds
    assert found.dismantling.holds
    assert sorted(pull.name for pull in found.dismantling.pulls) == sorted(body.name for body in found.bodies)
    assert found.record()["separable"]["holds"]
