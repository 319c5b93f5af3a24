"""The bare loop at the door is the loop."""

import numpy as np
import pytest

import rasp_core as rasp
from data_fetch import kitchen_like
from rasp_core import optimizer
from rasp_core.problem import Problem, Settings
from rasp_core.util.errors import InputError

BOX = rasp.box(0.2, 0.2, 0.2)


def test_it_is_the_loop_with_a_certificate():
    found = rasp.optimize(kitchen_like(3), BOX, iterations=5, resolution=64, seed=2)
    alone = optimizer.optimize(Problem(kitchen_like(3), BOX), Settings(iterations=5, resolution=64, seed=2))
    assert np.array_equal(found.matrices, alone.matrices)
    assert np.array_equal(found.history, alone.history)
    assert f"{len(found.certificate.overlaps)} pairs overlap" in repr(found) or found.certificate.holds
    assert repr(found).startswith("<Arrangement of 3 objects, density ")


def test_settings_that_are_not_there_and_containers_to_be_found_are_refused():
    with pytest.raises(InputError, match="lamda"):
        rasp.optimize(kitchen_like(2), BOX, lamda=1.0)
    with pytest.raises(InputError, match=r"rasp\.pack"):
        rasp.optimize(kitchen_like(2), "auto")
