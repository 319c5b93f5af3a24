"""The loading of a container as it is recorded and shown: part by part, each on its straight way."""

import json
from dataclasses import replace

import chromium
import numpy as np
import pytest
import read_recording

import rasp_core as rasp
from data_fetch import kitchen_like
from rasp_core.util.errors import InputError
from rasp_core.visualize.loading_order import LoadingOrder
from tests import judge

NAME = "</script><script>throw 1</script>"
SHOWN = "document.querySelector('.rasp-recording').recording"


@pytest.fixture(scope="module")
def packed():
    pool = kitchen_like(7)
    pool[0] = replace(pool[0], name=NAME)
    return rasp.pack(pool, rasp.box(0.17, 0.17, 0.17), method="spectral", separable=True)


def test_parts_come_one_after_the_other_along_straight_lines(packed):
    encoded = packed.loading.encoded()
    _, (poses,), _ = read_recording.read(encoded)
    loading, names = packed.dismantling.to_dict()["loading"], [name for name, _, _ in encoded["objects"]]
    assert encoded["loading"]["names"] == [step["name"] for step in loading]
    assert np.isnan(poses[0, :, 0]).all(), "empty at first"
    step, first = encoded["place"][3] / 8191, 1
    true = dict(zip((body.name for body in packed.bodies), packed.poses.translation.numpy(), strict=True))
    for stop, one in zip(encoded["loading"]["stops"], loading, strict=True):
        which = names.index(one["name"])
        way = poses[first : stop + 1, which, :3]
        assert np.isnan(poses[:first, which, 0]).all()
        assert np.abs(poses[stop:, which, :3] - true[one["name"]]).max() < step
        assert np.linalg.norm(way[0] - way[-1]) > one["length"]
        across = (way - way[-1]) - np.outer((way - way[-1]) @ one["direction"], one["direction"])
        assert np.abs(across).max() < 2 * step
        assert (np.diff(way @ one["direction"]) > 0).all(), "always inwards"
        still = np.delete(poses[first : stop + 1, :, :3], which, 1)
        assert np.array_equal(still, np.broadcast_to(still[:1], still.shape), equal_nan=True)
        first = stop + 1
    assert first == len(poses)


def test_no_part_passes_through_another_at_200_samples_of_its_way(packed, tmp_path):
    """By booleans of scene.glb, and the order of result.json."""
    folder = packed.save(tmp_path / "run")
    objects = judge.read(folder / "scene.glb")
    loading = json.loads((folder / "result.json").read_text())["separable"]["loading"]
    assert len(loading) == len(objects) >= 6
    assert judge.most_shared_on_the_way(objects, loading) <= 1e-4
    assert (folder / "load.html").exists()
    backwards = judge.most_shared_on_the_way(objects, loading[::-1], samples=40)
    assert backwards > 0.01, "in another order they do"


def test_what_stays_is_there_from_the_start(packed):
    part = replace(packed.dismantling, pulls=packed.dismantling.pulls[:2])
    shown = LoadingOrder(packed.bodies, packed.matrices, packed.container, part)
    assert shown.runs[0].present[0].sum() == len(packed.bodies) - 2
    assert repr(shown) == "<Loading of 2 objects, one by one>"


def test_a_packing_of_which_it_was_not_asked_has_none(packed, tmp_path):
    alone = replace(packed, dismantling=None)
    with pytest.raises(InputError, match="pack with separable=True"):
        _ = alone.loading
    assert not (alone.save(tmp_path / "run") / "load.html").exists()


class TestInABrowser:
    pytestmark = chromium.NEEDED

    @pytest.fixture
    def shown(self, page, packed, tmp_path):
        page.on("request", lambda asked: asked.url.startswith("file:") or page.problems.append(asked.url))
        page.goto(packed.loading.save(tmp_path / "load.html").as_uri())
        page.wait_for_function(SHOWN)
        yield page
        assert page.problems == []

    def test_parts_are_listed_and_told(self, shown, packed):
        names = [pull.name for pull in reversed(packed.dismantling.pulls)]
        items = shown.locator("li")
        assert [text.split(" (at")[0] for text in items.all_inner_texts()] == names
        many = len(names)
        assert shown.title() == "How the container is loaded"
        assert shown.get_by_text(f"{many} of {many}: {names[-1]}").count() == 1
        shown.locator("input[name='step']").press("Home")
        assert shown.get_by_text(f"{many} parts to load").count() == 1
        for k in range(2):
            shown.get_by_role("button", name="Next").click()
            assert shown.get_by_text(f"{k + 1} of {many}: {names[k]}").count() == 1
            assert items.nth(k).get_attribute("class") == "now"
            assert items.nth(k + 1).get_attribute("class") == "later"
        shown.get_by_role("button", name="Back").click()
        assert shown.get_by_text(f"1 of {many}: {names[0]}").count() == 1
        items.nth(3).click()
        assert shown.get_by_text(f"4 of {many}: {names[3]}").count() == 1
        assert shown.get_by_text("loss").count() == 0
        assert shown.get_by_text("Shadows").count() == 0

    def test_it_plays_to_the_end(self, shown, packed):
        shown.locator("input[name='step']").press("End")
        shown.evaluate(f"({SHOWN}).show(({SHOWN}).state.frame - 12)")
        shown.get_by_role("button", name="Play").click()
        shown.get_by_role("button", name="Pause").wait_for()
        shown.get_by_role("button", name="Play").wait_for()
        points = np.array(shown.evaluate(f"Array.from({SHOWN}.points)")).reshape(-1, 3)
        true = np.concatenate([b.placed(m) for b, m in zip(packed.bodies, packed.matrices, strict=True)])
        assert np.abs([points.min(0) - true.min(0), points.max(0) - true.max(0)]).max() < 1e-3
