"""Pressing finds a smaller box that holds; what it begins with is the best."""

import numpy as np
import pytest

from data_fetch import kitchen_like
from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import FreeBox, box
from rasp_core.packing.best_box import BestBox
from rasp_core.packing.constructive import Placement
from rasp_core.packing.pressing import TUNING, Pressing
from rasp_core.poses import file_to_world


@pytest.fixture
def best():
    """Six objects as a placement has them in a roomy box."""
    bodies = kitchen_like(6)
    best = BestBox(bodies, FreeBox((None, None, None)), lambda edges, density: None)
    placement = Placement(bodies, box((0.25, 0.25, 0.25)), 0, "spectral", straight=True)
    placement.fill(None, lambda: False)
    assert best.keep(placement.poses.take(np.argsort(list(placement.placed))))
    return best


def test_the_box_gets_smaller_and_holds(best):
    before, pressing = best.least, Pressing(best, 0, ending=lambda: False)
    pressing.begin()
    for _ in range(40):
        pressing.improve(lambda: False)
    pressing.end(lambda: False)
    assert best.least < before
    assert certify(
        best.bodies, file_to_world(best.bodies, best.poses.rotation, best.poses.translation), best.container
    ).holds


def test_it_begins_in_a_box_that_is_too_small(best):
    pressing = Pressing(best, 0, ending=lambda: False)
    pressing.begin()
    assert np.prod(pressing.state.edges) == pytest.approx(best.least * (1 - TUNING.too_small_by_of_volume))


def test_the_box_does_not_grow_when_time_is_over(best):
    before, pressing = best.least, Pressing(best, 0, ending=lambda: True)
    pressing.begin()
    for _ in range(5):
        pressing.improve(lambda: True)
    assert best.least == before
