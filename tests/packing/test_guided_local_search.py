"""A search in a box too small finds less overlap, tires of what is stuck, and says how much overlaps."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from data_fetch import kitchen_like
from rasp_core.geometry.containers import FreeBox, parse
from rasp_core.packing import guided_local_search
from rasp_core.packing.guided_local_search import GuidedLocalSearch

EDGES = np.full(3, 0.13)


def begun(shape="auto", count=6):
    random = np.random.default_rng(0)
    search = GuidedLocalSearch(kitchen_like(count), parse(shape), random)
    rotation = Rotation.random(count, random_state=random).as_matrix()
    return search, search.begin(rotation, 0.03 * random.standard_normal((count, 3)), EDGES)


def tune(monkeypatch, **numbers):
    monkeypatch.setattr(guided_local_search, "TUNING", replace(guided_local_search.TUNING, **numbers))


def test_overlap_falls_in_a_box_too_small():
    search, state = begun()
    first = state
    for _ in range(20):
        before, state = state, search.improve(state)
        assert state.energy <= before.energy
    assert 0 < state.energy < first.energy
    assert state.energy_of_body.sum() == pytest.approx(state.energy)
    alone = search.press(search.rough, state.rotation, state.translation, state.edges)
    assert alone.energy <= state.energy * (1 + 1e-9), "the energy is that of the poses"


def test_the_same_seed_gives_the_same_state():
    (one, first), (other, second) = begun(), begun()
    assert np.array_equal(one.improve(first).translation, other.improve(second).translation)


def test_tries_without_gain_are_counted_until_weights_change(monkeypatch):
    tune(monkeypatch, tries_before_weighing=2)
    search, state = begun()
    stuck = replace(state, energy=state.energy * 1e-9)  # no move is better than that
    for tries in (1, 2):
        stuck = search.improve(stuck)
        assert stuck.tries_without_gain == tries
        assert (stuck.weight == 1).all()
    weighed = search.improve(stuck)
    assert weighed.tries_without_gain == 0
    assert weighed.weight.mean() == pytest.approx(1)
    assert weighed.weight.argmax() == stuck.energy_of_body.argmax()
    assert (weighed.rotation == stuck.rotation).all()


def test_what_stays_overlapping_weighs_more():
    search, state = begun()
    state = replace(state, energy_when_grown=2 * state.energy)
    after = search._weighed(state)
    gain = after.weight / state.weight
    assert gain.argmax() == state.energy_of_body.argmax()
    assert after.weight.mean() == pytest.approx(1)
    assert after.energy_when_grown == pytest.approx(2 * after.energy)
    assert (after.rotation == state.rotation).all()


@pytest.mark.parametrize(("shape", "changes"), [("auto", True), ("auto:cube", False), ("auto:0.13,0.13,*", False)])
def test_free_edges_change_at_the_same_volume(monkeypatch, shape, changes):
    tune(monkeypatch, reshaped_fraction_of_tries=1.0)
    search, state = begun(shape)
    edges, rotation, translation = search._moved(state)
    moves = guided_local_search.TUNING.moves_per_try
    assert rotation.shape == (moves, 6, 3, 3)
    assert translation.shape == (moves, 6, 3)
    assert np.prod(edges) == pytest.approx(np.prod(EDGES))
    assert (edges != EDGES).any() == changes
    assert (state.edges == EDGES).all()


def test_fixed_edges_stay(monkeypatch):
    tune(monkeypatch, reshaped_fraction_of_tries=1.0)
    search, state = begun()
    search.shape = FreeBox((None, None, 0.13))
    edges, _, _ = search._moved(state)
    assert edges[2] == 0.13
    assert edges[0] != 0.13
