"""What stands and what falls, compared with the angle of a box's diagonal."""

import numpy as np
import pytest
import trimesh

from rasp_core.physics.standing import stand
from rasp_core.util.errors import InputError


def leaning(by: float, unit: float = 1.0):
    """A box of 1 x 1 x 3 whose upper face is shifted by so much."""
    mesh = trimesh.creation.box((1, 1, 3))
    mesh.vertices[mesh.vertices[:, 2] > 0, 0] += by
    return unit * mesh.vertices, mesh.faces


@pytest.mark.parametrize("unit", [1.0, 1000.0])
def test_a_box_stands_until_its_diagonal_is_upright(unit):
    found = stand(*leaning(0.0, unit))
    assert found.stands
    assert found.tips_deg == pytest.approx(np.degrees(np.arctan(0.5 / 1.5)))
    assert found.moved == pytest.approx(0, abs=1e-3)
    assert found.line() == "stands for 5 s, and until tilted by 18 degrees"
    assert found.to_dict()["stands"]


def test_a_box_that_leans_too_far_falls():
    assert stand(*leaning(0.9)).stands
    found = stand(*leaning(1.1))
    assert found.tips_deg < 0
    assert found.turned_deg > 45
    assert not found.stands
    assert found.line().startswith("does not stand: turned by")


def test_a_sphere_has_no_footing():
    mesh = trimesh.creation.icosphere(3)
    assert not stand(mesh.vertices, mesh.faces).stands


def test_seconds_are_positive():
    with pytest.raises(InputError, match="must be positive, got 0"):
        stand(*leaning(0.0), seconds=0)
