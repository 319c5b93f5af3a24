"""Recorded runs in headless Chromium: from a file, with three.js and without, as pages and as a widget's state."""

import io
import json
import re
from dataclasses import replace

import chromium
import numpy as np
import pytest
import torch
from PIL import Image

from data_fetch import kitchen_like
from rasp_core.geometry.containers import box
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.silhouette_edges import Outlines, Views
from rasp_core.problem import Settings
from rasp_core.silhouettes import render
from rasp_core.visualize import recording_page
from rasp_core.visualize.recording import Recording, record

NAME = "</script><script>throw 1</script>"
BODIES = [kitchen_like(8)[k] for k in (0, 1, 4, 7)]
BODIES[0] = replace(BODIES[0], name=NAME)
ROOM = box((0.2, 0.25, 0.3))
SHOWN = "document.querySelector('.rasp-recording').recording"


@pytest.fixture(scope="module")
def recorded():
    quick = Settings(iterations=40, resolution=64, query_points=2000)
    return record(BODIES, ROOM, quick, lambdas=[0.001, 10], epsilons=[0.001, 0.05], frames=12)


def opened(page, path):
    """The page at a path, shown; what it has said and asked for is gathered in `page.problems`."""
    page.on("console", lambda said: (said.type == "error" or "THREE" in said.text) and page.problems.append(said.text))
    page.on("request", lambda asked: asked.url.startswith("file:") or page.problems.append(asked.url))
    page.goto(path.as_uri())
    page.wait_for_function(SHOWN)
    page.wait_for_timeout(200)


def drawn(page) -> np.ndarray:
    """The canvas's pixels `(H, W, 3)`."""
    page.wait_for_timeout(100)
    return np.asarray(Image.open(io.BytesIO(page.locator("canvas").screenshot())).convert("RGB"), int)


def differ(one: np.ndarray, other: np.ndarray) -> float:
    """The share of pixels that differ clearly."""
    return (np.abs(one - other).max(2) > 60).mean()


def slide(page, name, key):
    slider = page.locator(f"input[name='{name}']")
    slider.focus()
    slider.press(key)


@pytest.mark.parametrize("three", [True, False], ids=["three.js", "canvas"])
class TestInABrowser:
    pytestmark = chromium.NEEDED

    @pytest.fixture
    def shown(self, page, recorded, three, tmp_path):
        path, data = tmp_path / "run.html", json.dumps(recorded.encoded())
        text = recorded.save(path).read_text() if three else recording_page.cell(data, "<p>a picture</p>")
        path.write_text(f"<!DOCTYPE html>{text}")
        opened(page, path)
        assert bool(page.evaluate(f"!!{SHOWN}.silhouette")) == three
        yield page
        assert page.problems == []

    def test_sliders_change_the_picture(self, shown):
        last = drawn(shown)
        assert (last.min(2) < 100).mean() > 0.02, "shadows before a white ground"
        assert shown.get_by_text("iteration 40 of 40").count() == 1
        slide(shown, "iteration", "Home")
        first = drawn(shown)
        assert shown.get_by_text("iteration 0 of 40").count() == 1
        assert differ(first, last) > 0.02
        slide(shown, "iteration", "End")
        assert differ(drawn(shown), last) < 0.001
        slide(shown, "lambda", "End")
        other = drawn(shown)
        assert shown.get_by_text("lambda: 10").count() == 1
        assert differ(other, last) > 0.01
        slide(shown, "epsilon (m)", "End")
        assert shown.get_by_text("epsilon (m): 0.05").count() == 1
        assert differ(drawn(shown), other) > 0.002
        assert shown.get_by_text("a picture").count() == 0

    def test_objects_are_where_they_were(self, shown, recorded):
        shown.evaluate(f"({SHOWN}).choose([1, 0]), ({SHOWN}).show(5)")
        points = np.array(shown.evaluate(f"Array.from({SHOWN}.points)")).reshape(-1, 3)
        (run,) = (run for run in recorded.runs if list(run.values.values()) == [10, 0.001])
        first = 0
        for body, rotation, translation in zip(BODIES, run.rotation[5], run.translation[5], strict=True):
            true = body.solid_vertices @ rotation.T + translation
            found = points[first : first + len(true)]
            assert np.abs(found - true).max() < 2e-4, "no surface here is simplified"
            first += len(true)
        assert first == len(points)

    def test_it_turns_and_plays(self, shown):
        before = drawn(shown)
        shown.mouse.move(300, 200)
        shown.mouse.down()
        shown.mouse.move(380, 230, steps=4)
        shown.mouse.up()
        turned = drawn(shown)
        assert differ(turned, before) > 0.03
        shown.mouse.wheel(0, 600)
        assert differ(drawn(shown), turned) > 0.03
        shown.get_by_role("button", name="Play").click()
        shown.get_by_role("button", name="Pause").wait_for()
        shown.get_by_role("button", name="Play").wait_for()
        assert shown.get_by_text("iteration 40 of 40").count() == 1


@pytest.mark.browser
@pytest.mark.skipif(chromium.CHROMIUM is None, reason="no Chromium here; Debian: apt-get install chromium")
def test_shadows_are_the_kits_silhouettes(page, recorded, tmp_path):
    opened(page, recorded.save(tmp_path / "run.html"))
    for frame in (0, 11):
        page.evaluate(f"({SHOWN}).show({frame})")
        run = recorded.runs[0]
        poses = (torch.from_numpy(part[frame]).float() for part in (run.rotation, run.translation))
        views = Views(recorded.cameras, "cpu", torch.float32)
        true = render(Outlines(BODIES, "cpu", torch.float32), *poses, views, 256).numpy()
        for view in range(3):
            found = page.evaluate(f"{SHOWN}.silhouette({view}).map((value) => value / 255).join('')")
            found = np.array([*found], float).reshape(256, 256)[::-1]
            assert 0.02 < true[view].mean() < 0.5
            assert np.abs(found - true[view]).mean() < 0.01 * true[view].mean() + 0.002


def test_a_page_and_a_cell_hold_names_as_words(recorded):
    data = json.dumps(recorded.encoded())
    assert NAME in json.loads(data)["objects"][0][0]
    for text in (recording_page.page(data), recording_page.cell(data)):
        (held,) = re.findall(r'<script type="application/json">(.*?)</script>', text)
        assert json.loads(held) == json.loads(data)
        assert "throw 1</script>" not in text


def test_three_js_is_whole_and_names_its_licence():
    text = recording_page.three_js()
    assert "SPDX-License-Identifier: MIT" in text[:200]
    assert "WebGLRenderer" in text
    assert text.endswith("}));")
    assert "GLTFLoader" not in text


def test_a_notebook_keeps_data_and_a_picture_but_not_three_js(recorded, monkeypatch):
    held = recorded._repr_mimebundle_()
    assert held["text/plain"] == repr(recorded)
    assert set(held) == {"text/plain", "text/html"}, "no kernel, so no widget"
    assert '<img width="480"' in held["text/html"]
    assert "WebGLRenderer({" in held["text/html"], "the module names it"
    assert "Three.js Authors" not in held["text/html"]
    kernel = type("Shell", (), {"kernel": None})()
    monkeypatch.setattr("IPython.get_ipython", lambda: kernel)
    assert recording_page.WIDGET in recorded._repr_mimebundle_()


def test_a_widget_sends_three_js_when_it_is_asked(recorded, monkeypatch):
    data = json.dumps(recorded.encoded())
    shown = recording_page.widget(data)
    state = shown.get_state()
    assert state["recording"] == data
    assert len(json.dumps(state)) < len(data) + 40_000
    assert "Three.js Authors" not in json.dumps(state)
    sent = []
    monkeypatch.setattr(shown, "send", lambda content, buffers: sent.append(buffers))
    shown._handle_custom_msg({"wanted": "three.js"}, [])
    assert sent == [[recording_page.three_js().encode()]]


def test_an_object_that_left_is_not_in_the_picture():
    ball = make_body("ball", BODIES[1].vertices, BODIES[1].faces)
    run = record([ball, BODIES[2]], ROOM, Settings(iterations=2, resolution=32, query_points=500), frames=2).runs[0]
    present = run.present.copy()
    present[-1, 0] = False
    left = Recording([ball, BODIES[2]], ROOM, [replace(run, present=present)])
    assert 'alt="1 objects"' in left._repr_mimebundle_()["text/html"]
