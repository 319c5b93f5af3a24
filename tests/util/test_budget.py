"""Seconds and tries are counted, and either ends a search."""

import pytest

from rasp_core.util import budget
from rasp_core.util.budget import Budget
from rasp_core.util.errors import InputError


def test_tries_end_it():
    tries = Budget(effort=10)
    assert not tries.over()
    tries.tries = 5
    assert tries.over(0.5)
    assert not tries.over()
    assert not tries.spent()
    tries.tries = 10
    assert tries.over()


def test_time_ends_it(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(budget.time, "monotonic", lambda: now[0])
    seconds = Budget(time_limit=10, effort=10**6)
    assert not seconds.spent()
    now[0] = 106.0
    assert seconds.spent(0.5)
    assert not seconds.over()
    now[0] = 111.0
    assert seconds.spent()
    assert seconds.over()


def test_what_is_used_is_the_larger_part(monkeypatch):
    monkeypatch.setattr(budget.time, "monotonic", lambda: 100.0)
    both = Budget(time_limit=10, effort=100)
    both.tries = 20
    monkeypatch.setattr(budget.time, "monotonic", lambda: 101.0)
    assert both.used == pytest.approx(0.2)
    monkeypatch.setattr(budget.time, "monotonic", lambda: 105.0)
    assert both.used == pytest.approx(0.5)
    assert both.seconds(3) == pytest.approx(0.3)


def test_without_limits_it_never_ends():
    assert not Budget().over()
    assert Budget().used == Budget().seconds(3) == 0


def test_a_negative_effort_is_refused():
    with pytest.raises(InputError, match="effort must not be negative, got -1"):
        Budget(effort=-1)
