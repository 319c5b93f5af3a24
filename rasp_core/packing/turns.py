"""Means of a search that take turns: the one that gained more in its last turn goes on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..util.budget import Budget

TURNS = 10  # of all means together, in a budget
END_AT = 0.97  # of the budget, the last one


class Turns:
    """Of these means, in a budget.

    now : which has its turn, the first one at first, None if there are none. gains : of each in its last turn, infinite
    before that.
    """

    def __init__(self, means: Sequence[str], budget: Budget) -> None:
        self.budget, self.now, self.turn = budget, next(iter(means), None), 1
        self.gains = dict.fromkeys(means, np.inf)

    def over(self) -> bool:
        """Whether the present turn is."""
        return self.budget.over(END_AT * self.turn / TURNS)

    def next(self, gained: float) -> bool:
        """The next turn, after one that `gained` so much; whether it is another's."""
        self.gains[self.now], self.turn = gained, self.turn + 1
        best = max((means for means in self.gains if means != self.now), key=self.gains.get, default=self.now)
        changed = best != self.now and self.gains[best] >= gained
        self.now = best if changed else self.now
        return changed
