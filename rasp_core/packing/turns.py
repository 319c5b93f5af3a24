"""Means of a search that take turns: the one that gained more in its last turn goes on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..util.budget import Budget

TURNS = 10  # of all means together, in a budget
END_AT = 0.97  # of the budget, the last one
MOST_NEEDED = 0.15  # of the budget, to end the last one


class Turns:
    """Of these means, in a budget, of which all turns that are left have an equal part.

    now : which has its turn, the first one at first, None if there are none. gains : of each in its last turn, infinite
    before that. left : turns; 0 where the budget has none any more.
    """

    def __init__(self, means: Sequence[str], budget: Budget) -> None:
        self.budget, self.now, self.left = budget, next(iter(means), None), TURNS
        self.until = END_AT / TURNS
        self.gains = dict.fromkeys(means, np.inf)

    def over(self, going: bool = False, needed: float = 0.0) -> bool:
        """Whether the present turn is. going : it goes on as long as there is time, for it gains now. needed : seconds
        that its end takes."""
        last = END_AT - min(self.budget.seconds(needed), MOST_NEEDED)
        return self.budget.over(last if going else min(self.until, last))

    def next(self, gained: float) -> bool:
        """The next turn, after one that `gained` so much; whether it is another's."""
        self.gains[self.now], self.left = gained, self.left - 1
        self.left = 0 if self.budget.over(END_AT) else max(self.left, 1)
        self.until = self.budget.used + (END_AT - self.budget.used) / max(self.left, 1)
        best = max((means for means in self.gains if means != self.now), key=self.gains.get, default=self.now)
        changed = best != self.now and self.gains[best] >= gained
        self.now = best if changed else self.now
        return changed
