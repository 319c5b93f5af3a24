"""The smallest box so far: what holds and is smaller replaces it, nothing else does."""

import numpy as np
import pytest
import torch
import trimesh

from rasp_core.geometry.containers import FreeBox
from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.packing.best_box import BestBox
from rasp_core.poses import Poses

CUBE = trimesh.creation.box((0.1, 0.1, 0.1))
CUBES = unique_names([make_body("cube", CUBE.vertices, CUBE.faces)] * 2)


def apart(distance):
    places = torch.tensor([[0, 0, 0], [0, 0, distance]], dtype=torch.float64)
    return Poses(torch.eye(3).double().repeat(2, 1, 1), places)


@pytest.fixture
def best():
    """Two cubes in a strip, and what was told of them."""
    told = []
    best = BestBox(CUBES, FreeBox((0.1, 0.1, None)), lambda edges, density: told.append((edges[2], density)))
    best.heard = told
    return best


def test_what_is_smaller_and_holds_is_kept(best):
    assert best.least == np.inf
    assert best.keep(apart(0.2))
    assert best.keep(apart(0.1))
    assert best.least == pytest.approx(0.1 * 0.1 * 0.2)
    assert best.heard == [pytest.approx((0.3, 2 / 3)), pytest.approx((0.2, 1.0))]
    assert not best.keep(apart(0.15)), "it is larger"
    assert not best.keep(apart(0.05)), "they overlap"
    assert best.container.size[2] == pytest.approx(0.2)


def test_a_hair_of_overlap_is_taken_out_before(best):
    centred = apart(0.1 - 2e-5)
    centred.translation[:, 2] -= (0.1 - 2e-5) / 2
    assert best.hold(centred, np.array([0.1, 0.1, 0.2002]))
    assert 0.2 - 1e-5 < best.container.size[2] <= 0.2002
    assert not best.hold(apart(0.02), np.array([0.1, 0.1, 0.15]), largest=0.01), "that is more than a hair"
