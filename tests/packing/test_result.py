"""How a packing ends, and what it says of itself."""

import numpy as np
import pytest

from data_fetch import kitchen_like
from rasp_core.geometry.containers import box
from rasp_core.optimizer import optimize
from rasp_core.packing.result import finish
from rasp_core.problem import Problem, Settings
from rasp_core.util.errors import InputError

ROOM = box((0.2, 0.2, 0.2))


@pytest.fixture(scope="module")
def bodies():
    return kitchen_like(24)


@pytest.fixture(scope="module")
def found(bodies):
    return optimize(Problem(bodies[3:6], ROOM), Settings(iterations=5, resolution=64))


@pytest.fixture(scope="module")
def ended(bodies, found):
    return finish(bodies, [3, 4, 5], found.poses, ROOM, found.settings)


def test_an_ended_packing_is_drawn_as_the_loop_draws_it(found, ended):
    assert ended.images == pytest.approx(found.images, abs=1e-3)
    assert ended.arrangement.targets == pytest.approx(found.targets)
    assert np.array_equal(ended.matrices, found.matrices)


def test_a_packing_says_what_lies_where(bodies, found, ended):
    assert ended.bodies == bodies[3:6]
    assert ended.container is ROOM
    assert (ended.poses.translation == found.translation).all()
    assert ended.images.shape == (3, 64, 64)
    assert ended.density == pytest.approx(sum(body.volume for body in bodies[3:6]) / 0.008)


def test_packing_without_choice_is_refused(bodies):
    with pytest.raises(InputError, match="not one of the objects"):
        finish(bodies, [], None, ROOM, Settings())
