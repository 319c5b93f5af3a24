"""Objects pressed apart hold; if there is no room nothing is said to hold."""

import numpy as np
import pytest
import torch

from data_fetch import kitchen_like
from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import box
from rasp_core.packing import separation
from rasp_core.packing.layout import Layout
from rasp_core.packing.separation import Pressed, Separation
from rasp_core.poses import Poses, file_to_world
from rasp_core.problem import Settings

ROOM = box((0.2, 0.2, 0.2))


def straight(chosen, *centres):
    rotation = torch.eye(3).repeat(len(centres), 1, 1)
    return Layout(chosen, Poses(rotation, torch.tensor(centres, dtype=torch.float32)))


@pytest.fixture
def pressing():
    return Separation(kitchen_like(6), ROOM, Settings(), torch.device("cpu"), spent=lambda: False)


def test_two_that_overlap_settle(pressing):
    layout = straight([2, 0], (-0.03, 0, 0), (0.03, 0, 0))
    bodies = layout.bodies(pressing.pool)
    assert not certify(bodies, file_to_world(bodies, layout.poses.rotation, layout.poses.translation), ROOM).holds
    pressed = pressing.press(layout, seed=0)
    assert pressed.overlap >= 0
    assert sorted(pressed.overlap_after) == list(separation.TUNING.checked_iterations)
    settled = pressing.settle(pressed.layout, seed=0)
    assert settled.chosen == [2, 0]
    assert certify(bodies, file_to_world(bodies, settled.poses.rotation, settled.poses.translation), ROOM).holds
    assert all(len(history) for history in pressing.history)


def test_only_the_movers_move(pressing):
    row = straight([0, 1, 2, 3], (-0.07, 0, 0), (0.07, 0, 0), (0, 0.07, 0), (0.05, 0, 0))
    moved = pressing.press(row, 0, movers=[1, 3]).layout
    same = (moved.poses.translation == row.poses.translation).all(1)
    assert same.tolist() == [True, False, True, False]


def test_what_cannot_hold_does_not_settle(pressing):
    assert pressing.settle(straight([0, 1], (0, 0, 0), (0, 0, 0)), seed=0) is None


def test_nothing_settles_when_time_is_over(pressing):
    pressing.spent = lambda: True
    assert pressing.settle(straight([0, 1], (-0.05, 0, 0), (0.05, 0, 0)), seed=0) is None


def test_what_looks_hopeless_is_settled_by_the_patient_only(pressing, monkeypatch):
    layout = straight([0, 1], (-0.05, 0, 0), (0.05, 0, 0))
    course = {iteration: 1.0 for iteration in separation.TUNING.checked_iterations}
    left = Pressed(layout, 1.01 * pressing.hopeless_overlap, course)
    monkeypatch.setattr(pressing, "press", lambda *_: left)
    monkeypatch.setattr(pressing, "settle", lambda layout, *_: layout)
    assert pressing.separate(layout, 0) is None
    assert not pressing.successes
    assert pressing.separate(layout, 0, patient=True) is layout
    assert list(pressing.successes) == [course]


def test_pressing_is_given_up_if_it_overlaps_much_more_than_successes_did(pressing):
    """Three objects in one place; those that came to hold overlapped less after the first checked iterations."""
    layout = straight([0, 1, 2], (0, 0, 0), (0, 0, 0), (0, 0, 0))
    first = separation.TUNING.checked_iterations[0]
    whole = pressing.press(layout, seed=0)
    little = dict.fromkeys(separation.TUNING.checked_iterations, 0.0)
    pressing.successes.extend([little] * separation.TUNING.successes_remembered)
    pressing.hopeless_overlap = whole.overlap_after[first] / 2
    given_up = pressing.press(layout, seed=0)
    assert list(given_up.overlap_after) == [first]
    assert len(pressing.history[-1]) == first + 1 < len(pressing.history[0])


def test_lengths_follow_the_container():
    long = Separation(kitchen_like(2), box((0.1, 0.4, 0.1)), Settings(), torch.device("cpu"), spent=lambda: False)
    assert long.width == pytest.approx(0.44)
    assert np.isfinite(long.hopeless_overlap)


def test_shadows_guide_where_they_are_asked_for():
    """Two cans apart: nothing presses but shadows, which want the whole box dark; without them nothing moves."""
    far = straight([0, 1], (-0.045, 0, 0), (0.045, 0, 0))
    found = {}
    for shadows in (False, True):
        pressing = Separation(
            kitchen_like(2), ROOM, Settings(resolution=32), torch.device("cpu"), spent=lambda: False, shadows=shadows
        )
        found[shadows] = pressing.press(far, seed=0).layout.poses.translation
        pulled = np.concatenate(pressing.pulls)
        assert (pulled[:, 0] > 0).all() == shadows
    start = far.poses.translation.double()
    assert (found[True] - start).norm(dim=1).max() > 10 * (found[False] - start).norm(dim=1).max() + 1e-3


def test_with_shadows_all_others_are_drawn():
    pressing = Separation(
        kitchen_like(4), ROOM, Settings(resolution=32), torch.device("cpu"), spent=lambda: False, shadows=True
    )
    row = straight([0, 1, 2], (-0.07, 0, 0), (0.07, 0, 0), (0, 0.07, 0))
    assert pressing._obstacles(row, [1]) == [0, 2]
    assert pressing.width == pytest.approx(0.4)
