"""A packing grows by what fits beside it, and never loses."""

import numpy as np
import pytest
import torch

from data_fetch import kitchen_like
from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import box
from rasp_core.packing.growth import TUNING, Growth
from rasp_core.packing.layout import Layout
from rasp_core.packing.separation import Separation
from rasp_core.poses import Poses, file_to_world
from rasp_core.problem import Settings

ROOM = box((0.22, 0.2, 0.2))
QUICK = Settings(query_points=10_000, resolution=64)


@pytest.fixture
def growth():
    pool, kept = kitchen_like(12), []
    separation = Separation(pool, ROOM, QUICK, torch.device("cpu"), spent=lambda: False)
    found = Growth(pool, ROOM, separation, np.random.default_rng(0), 0, kept.append)
    found.record = kept
    return found


def holds(growth, layout):
    bodies = layout.bodies(growth.pool)
    return certify(bodies, file_to_world(bodies, layout.poses.rotation, layout.poses.translation), ROOM).holds


def test_it_grows_from_nothing_and_what_it_keeps_holds(growth):
    layouts = [Layout.empty()]
    for number in range(6):
        layouts.append(growth.improve(layouts[-1], number))
    volumes = [sum(body.volume for body in layout.bodies(growth.pool)) for layout in layouts]
    assert volumes == sorted(volumes)
    assert len(layouts[-1]) >= 2
    assert growth.record
    assert growth.record[-1] is layouts[-1]
    assert all(holds(growth, layout) for layout in growth.record)
    assert len(set(layouts[-1].chosen)) == len(layouts[-1])


def test_what_does_not_come_to_hold_is_forgotten(growth, monkeypatch):
    one = Layout([0], Poses(torch.eye(3)[None], torch.zeros(1, 3)))
    monkeypatch.setattr(growth.separation, "separate", lambda *_: None)
    assert growth.improve(one, 0) is one
    assert not growth.record
    assert growth.yielding < TUNING.most_yielding_of_mean_volume


def test_more_are_inserted_at_once_while_that_succeeds(growth, monkeypatch):
    monkeypatch.setattr(growth.separation, "separate", lambda layout, *_: layout)
    layout = growth.improve(Layout.empty(), 0)
    assert growth.inserted_at_once == 2
    layout = growth.improve(layout, 1)
    assert len(layout) == 3
    assert growth.inserted_at_once == 4
