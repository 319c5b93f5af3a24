"""What hangs still and what turns over, compared with what must."""

from types import SimpleNamespace

import numpy as np
import pytest
from manifold3d import Manifold

from rasp_core.physics.swinging import swing
from rasp_core.util.errors import InputError


def thread(low, length=0.3, body=0, above=None):
    low = np.array(low, float)
    return SimpleNamespace(body=body, above=above, low=low, high=low + np.array([0, 0, length]))


CUBE = Manifold.cube([0.2] * 3, True)


@pytest.mark.parametrize("width", [1.0, 1000.0])
def test_a_cube_held_above_its_middle_hangs_still(width):
    found = swing([CUBE.scale([width] * 3)], [thread((side * width, 0, 0.1 * width)) for side in (-0.08, 0.08)], width)
    assert found.stays
    assert found.moved < 0.01
    assert found.line() == "hangs still after 5 s"
    assert found.to_dict()["stays"]


def test_a_cube_held_below_its_middle_turns_over():
    found = swing([CUBE], [thread((side, 0, -0.1)) for side in (-0.08, 0.08)], 1.0)
    assert not found.stays
    assert found.turned_deg > 45
    assert found.line().startswith("does not hang still: an object turned by ")


def test_a_cube_held_beside_its_middle_swings_to_one_side():
    assert not swing([CUBE], [thread((0.08, 0, 0.1))], 1.0).stays


def test_what_hangs_from_another_counts():
    below = CUBE.translate([0.3, 0, -0.5])
    plank = Manifold.cube([1.0, 0.2, 0.1], True)
    held = [thread((side, 0, 0.05), body=1) for side in (-0.4, 0.4)]
    hanging = [thread((0.3 + side, 0, -0.4), 0.35, 0, 1) for side in (-0.05, 0.05)]
    assert swing([below, plank], [*held, *hanging], 1.0).stays
    near = [thread((side, 0, 0.05), body=1) for side in (-0.05, 0.05)]
    assert not swing([below, plank], [*near, *hanging], 1.0).stays, "it tips where the load is outside"


def test_what_touches_may_be_joined_by_threads_of_no_length():
    below = CUBE.translate([0, 0, -0.2])
    held = [thread((side, 0, 0.1)) for side in (-0.08, 0.08)]
    joined = [thread((side, 0, -0.1), 0.0, 1, 0) for side in (-0.08, 0.08)]
    assert swing([CUBE, below], [*held, *joined], 1.0).stays


def test_seconds_are_positive():
    with pytest.raises(InputError, match="must be positive, got 0"):
        swing([CUBE], [thread((0, 0, 0.1))], 1.0, seconds=0)
