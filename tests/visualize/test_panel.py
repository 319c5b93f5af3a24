"""What the panel does, through the plain functions behind it and through the widgets' own values."""

import threading
from xml.etree import ElementTree

import ipywidgets
import numpy as np
import pytest

from data_fetch import kitchen_like
from rasp_core.geometry.containers import box
from rasp_core.problem import Settings
from rasp_core.visualize import panel as panels
from rasp_core.visualize.live import Controls

POOL, BOX = kitchen_like(5), box((0.2, 0.2, 0.2))
SETTINGS = Settings(iterations=30, query_points=5000, resolution=64)


@pytest.fixture
def panel():
    box_ = panels.panel(POOL, BOX, settings=SETTINGS)
    yield box_
    box_.live.close()


def find(box_, kind, description=None):
    found = [child for child in box_.children if isinstance(child, kind)]
    for child in box_.children:
        if isinstance(child, ipywidgets.Box):
            found += find(child, kind)
    return [w for w in found if description is None or getattr(w, "description", None) == description]


def test_the_still_picture_shows_scene_silhouettes_and_curves():
    picture, frame = panels.still(POOL, BOX, Controls(count=3), SETTINGS)
    tree = ElementTree.fromstring(picture)
    tags = [element.tag.split("}")[1] for element in tree.iter()]
    assert tags.count("image") == 1 + len(frame.images)
    assert tags.count("polyline") == 3
    assert len(frame.matrices) == 3
    facts = panels.facts_line(frame)
    assert facts.startswith("iteration 30: ")
    assert "exact booleans" in facts


def test_curves_follow_the_history():
    tree = ElementTree.fromstring(
        panels._curve(np.array([0.0, 1.0, 4.0]), "loss", "red", 10, 20, 100, 50).join(["<g>", "</g>"])
    )
    (line,) = [element for element in tree if element.tag == "polyline"]
    assert line.attrib["points"] == "10.0,70.0 60.0,57.5 110.0,20.0"


def test_run_draws_and_a_slider_moves_what_it_names(panel):
    (image,), (label,) = find(panel, ipywidgets.Image), find(panel, ipywidgets.Label)
    (run,) = find(panel, ipywidgets.Button, "Run")
    run.click()
    panel.live.wait()
    before = bytes(image.value), label.value
    assert bytes(before[0]).startswith(b"<svg")
    for description, value, name in (
        ("lambda", 10.0, "lambda_"),
        ("epsilon (m)", 0.001, "epsilon"),
        ("target height", 0.5, "height"),
        ("objects", 3, "count"),
        ("seed", 2, "seed"),
    ):
        (slider,) = find(panel, ipywidgets.Widget, description)
        slider.value = value
        assert getattr(panel.live.controls, name) == pytest.approx(value)
    run.click()
    panel.live.wait()
    assert (bytes(image.value), label.value) != before


def test_pause_step_and_reset_do_as_they_say(panel):
    (label,) = find(panel, ipywidgets.Label)
    for name, expected in (("Step", "iteration 1:"), ("Step", "iteration 2:"), ("Reset", "iteration 0:")):
        find(panel, ipywidgets.Button, name)[0].click()
        panel.live.wait()
        assert label.value.startswith(expected)
    find(panel, ipywidgets.Button, "Pause")[0].click()
    panel.live.wait()
    assert label.value.startswith("iteration 0:")


def test_the_overlap_term_and_the_weighting_can_be_chosen(panel):
    (overlap_term,) = find(panel, ipywidgets.Dropdown, "overlap term")
    overlap_term.value = "as_printed"
    (weighting,) = find(panel, ipywidgets.Dropdown, "weighting")
    weighting.value = "no_shadows"
    controls = panel.live.controls
    assert (controls.overlap_term, controls.weighting) == ("as_printed", "no_shadows")


def test_a_still_picture_leaves_no_thread_behind_if_it_is_interrupted(monkeypatch):
    def interrupted(live):
        raise KeyboardInterrupt

    monkeypatch.setattr(panels.LiveRun, "wait", interrupted)
    with pytest.raises(KeyboardInterrupt):
        panels.still(POOL, BOX, Controls(count=2), SETTINGS)
    assert not [thread for thread in threading.enumerate() if thread.name == "live"]
