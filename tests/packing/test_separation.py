"""Objects put into voids and pressed apart hold; where there is no room nothing is said to hold."""

import numpy as np
import pytest
import torch

from data_fetch import kitchen_like
from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import box
from rasp_core.packing import separation
from rasp_core.packing.separation import Press
from rasp_core.poses import Poses, file_to_world, join
from rasp_core.problem import Settings

ROOM = box((0.2, 0.2, 0.2))


@pytest.fixture
def press():
    return Press(kitchen_like(6), ROOM, Settings(), torch.device("cpu"), np.random.default_rng(0), lambda: False)


def test_an_object_goes_into_the_void_and_settles(press):
    press.look([], Poses(torch.zeros(0, 3, 3), torch.zeros(0, 3)))
    index, pose, shared = press.least_shared([2], np.inf)
    assert index == 2
    assert shared == 0
    press.look([2], pose)
    other, second, shared = press.least_shared([0, 1], np.inf)
    assert press.least_shared([0, 1], 0.0) is None
    start, overlap = press.apart([2, other], join(pose, second), seed=0)
    assert overlap >= 0
    settled = press.settle([2, other], start, seed=0)
    bodies = [press.pool[2], press.pool[other]]
    assert certify(bodies, file_to_world(bodies, settled.rotation, settled.translation), ROOM).holds
    assert all(len(history) for history in press.history)


def test_only_what_lies_about_a_new_object_is_pressed(press, monkeypatch):
    monkeypatch.setattr(separation, "VICINITY", 2)
    row = Poses(torch.eye(3).repeat(4, 1, 1), torch.tensor([[-0.07, 0, 0], [0.07, 0, 0], [0, 0.07, 0], [0.05, 0, 0]]))
    chosen = [0, 1, 2, 3]
    movers = press.vicinity(chosen, row, fresh=1)
    assert movers == [1, 3]
    moved, _ = press.apart(chosen, row, 0, movers)
    assert (moved.translation != row.translation).any(1).tolist() == [False, True, False, True]


def test_one_object_may_be_left_out_of_sight(press):
    there = Poses(torch.eye(3).repeat(2, 1, 1), torch.tensor([[-0.05, 0.0, 0.0], [0.05, 0.0, 0.0]]))
    press.look([0, 1], there, without=0)
    one = press.room.taken.copy()
    press.look([1], there.take([1]))
    assert (one == press.room.taken).all()


def test_what_cannot_hold_does_not_settle(press):
    inside = Poses(torch.eye(3).repeat(2, 1, 1), torch.zeros(2, 3))
    assert press.settle([0, 1], inside, seed=0) is None


def test_nothing_settles_when_time_is_over(press):
    press.spent = lambda: True
    apart = Poses(torch.eye(3).repeat(2, 1, 1), torch.tensor([[-0.05, 0.0, 0.0], [0.05, 0.0, 0.0]]))
    assert press.settle([0, 1], apart, seed=0) is None


def test_another_container_may_be_entered(press):
    press.enter(box((0.1, 0.4, 0.1)))
    assert press.width == pytest.approx(0.44)
    assert press.room.shape.argmax() == 1
