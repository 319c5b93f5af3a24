"""Whose turn it is among means that gain."""

import pytest

from rasp_core.packing.turns import END_AT, TURNS, Turns
from rasp_core.util.budget import Budget


@pytest.fixture
def turns():
    return Turns(["one", "other"], Budget(effort=100 * TURNS))


def test_each_has_a_turn_then_the_one_that_gained_more(turns):
    assert turns.now == "one"
    assert turns.next(0.1)
    assert turns.now == "other"
    assert turns.next(0.05), "less than the first gained"
    assert turns.now == "one"
    assert not turns.next(0.06)
    assert turns.now == "one"
    assert turns.next(0.0), "as much or more"
    assert turns.now == "other"


def test_turns_share_the_budget_out(turns):
    ends = []
    for turns.budget.tries in range(100 * TURNS):
        if turns.over():
            ends.append(turns.budget.tries)
            turns.next(0.0)
    assert ends == pytest.approx([END_AT * 100 * (k + 1) for k in range(TURNS)], abs=1)


def test_one_means_alone_goes_on():
    turns = Turns(["one"], Budget(effort=10))
    assert not turns.next(0.0)
    assert (turns.now, turns.turn) == ("one", 2)
