"""Whose turn it is among means that gain."""

import pytest

from rasp_core.packing.turns import END_AT, MOST_NEEDED, TURNS, Turns
from rasp_core.util import budget
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


def ends_of(turns, **asked):
    """The tries at which turns end, all of which gain nothing."""
    ends = []
    for turns.budget.tries in range(100 * TURNS):
        if turns.over(**asked):
            ends.append(turns.budget.tries)
            turns.next(0.0)
            if not turns.left:
                break
    return ends


def test_turns_share_the_budget_out(turns):
    assert ends_of(turns) == pytest.approx([END_AT * 100 * (k + 1) for k in range(TURNS)], abs=1)


def test_after_a_long_turn_the_others_share_what_is_left(turns):
    turns.budget.tries = 520
    assert turns.over()
    turns.next(1.0)
    assert turns.until == pytest.approx(0.52 + (END_AT - 0.52) / (TURNS - 1))


def test_one_that_gains_goes_on_until_the_end(turns):
    assert ends_of(turns, going=True) == [END_AT * 100 * TURNS]


@pytest.mark.parametrize(("needed", "last"), [(0.0, END_AT), (50.0, END_AT - 0.05), (900.0, END_AT - MOST_NEEDED)])
def test_what_an_end_needs_is_kept(monkeypatch, needed, last):
    now = [0.0]
    monkeypatch.setattr(budget.time, "monotonic", lambda: now[0])
    turns = Turns(["one"], Budget(time_limit=1000.0))
    for now[0], over in ((1000 * last - 1, False), (1000 * last + 1, True)):
        assert turns.over(going=True, needed=needed) == over


def test_one_means_alone_goes_on():
    turns = Turns(["one"], Budget(effort=10))
    assert not turns.next(0.0)
    assert (turns.now, turns.left) == ("one", TURNS - 1)
