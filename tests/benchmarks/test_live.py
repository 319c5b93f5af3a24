"""The panel at 20 objects: how soon the first frame comes, how often the next, how soon a change is drawn."""

import threading

import pytest

from data_fetch import kitchen_like
from rasp_core.geometry.containers import box
from rasp_core.problem import Settings
from rasp_core.visualize import panel as panels
from rasp_core.visualize.live import Controls

POOL, BOX = kitchen_like(20), box((0.3, 0.3, 0.3))
SETTINGS = Settings(iterations=100_000, resolution=64, query_points=20_000)


@pytest.fixture
def panel():
    """A panel whose `drawn` is set with each picture."""
    made = panels.panel(POOL, BOX, Controls(count=20), SETTINGS)
    made.drawn, watch = threading.Event(), made.live.watch

    def drawing(frame):
        watch(frame)
        made.drawn.set()

    made.live.watch = drawing
    yield made
    made.live.close()


def next_frame(panel):
    panel.drawn.clear()
    assert panel.drawn.wait(30)


def test_first_frame(benchmark, panel):
    def press_run():
        panel.live.run()
        next_frame(panel)

    benchmark.pedantic(press_run, rounds=1)


def test_update(benchmark, panel):
    panel.live.run()
    next_frame(panel)
    benchmark.pedantic(next_frame, args=(panel,), rounds=40)


def test_change_is_drawn(benchmark, panel):
    panel.live.run()
    next_frame(panel)

    def drag():
        panel.live.change(lambda_=panel.live.controls.lambda_ * 0.9)
        next_frame(panel)
        next_frame(panel)  # the first may have been under way

    benchmark.pedantic(drag, rounds=20)
