"""As few equal boxes as are found for all parts: one filled after the other, then refilled from what is over.

Boxes are filled by a placement, which needs no more time than it needs. Then a search, in the time that there is, is
offered a box's objects and those that are over: in no box, or else in the last one. What is worth more stays, and the
rest is over again, until nothing is, or every box has been tried in vain.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from ..exact.certificate import Certificate
from ..geometry.meshes import Body
from ..util.errors import InputError
from .pool import Worth

LEAST_SECONDS = 1.0  # for one box
GAINED = 1e-9  # of a box's volume: less is no gain


class Packed(Protocol):
    """What a search returns: indices into the pool offered, and what proves it."""

    chosen: list[int]
    certificate: Certificate


Place = Callable[[Sequence[Body]], Packed]
Search = Callable[[Sequence[Body], float | None], Packed]
Box = tuple[Packed, list[int]]


def least_number(bodies: Sequence[Body], volume: float) -> int:
    """Boxes of a volume in cubic metres that bodies need at least, by their own volumes."""
    return max(1, int(np.ceil(sum(body.volume for body in bodies) / volume * (1 - 1e-9))))


def fill_boxes(
    place: Place,
    search: Search,
    bodies: Sequence[Body],
    volume: float,
    most: int | None = None,
    time_limit: float | None = None,
) -> list[Box]:
    """For each box what is packed into it, and the indices of its objects among `bodies`, in their order there.

    place, search : called with bodies, search also with seconds, None without a `time_limit` for all; both raise
    InputError where nothing goes in. volume : of a box, cubic metres. most : boxes, as many as are needed if None; then
    what is over is in none of them. Raises InputError as the first placement does.
    """
    filling = _Filling(place, search, list(bodies), volume, time_limit)
    filling.fill(most)
    filling.refill()
    return filling.boxes


class _Filling:
    """Boxes under way. left : indices of what is in none of them."""

    def __init__(self, place: Place, search: Search, bodies: list[Body], volume: float, time_limit: float | None):
        self.place, self.search, self.bodies = place, search, bodies
        self.worth, self.volume = Worth(bodies), volume
        self.least = least_number(bodies, volume)
        self.ends = None if time_limit is None else time.monotonic() + time_limit
        self.boxes: list[Box] = []
        self.left = list(range(len(bodies)))

    def fill(self, most: int | None) -> None:
        """Box after box, until nothing is left, nothing goes in, or they are as many as are allowed."""
        while (self.left or not self.boxes) and (most is None or len(self.boxes) < most):
            try:
                box = self._packed(self.left, self.place)
            except InputError:
                if not self.boxes:
                    raise
                self.left = []  # what goes into no empty box is not offered to others
                self.least = least_number([self.bodies[i] for _, box in self.boxes for i in box], self.volume)
                return
            self.boxes.append(box)
            self.left = [i for i in self.left if i not in set(box[1])]

    def refill(self) -> None:
        """Offer each box what is over, one after the other, until all have been offered it in vain."""
        number, in_vain = 0, 0
        while in_vain < self._others and (self.left or len(self.boxes) > self.least):
            seconds = None
            if self.ends is not None:
                if (seconds := self.ends - time.monotonic()) < LEAST_SECONDS:
                    return
                seconds = max(LEAST_SECONDS, seconds / (self._others - in_vain))
            number, gained = (number + 1) % self._others, self._refilled(number % self._others, seconds)
            in_vain = 0 if gained else in_vain + 1

    @property
    def _others(self) -> int:
        """How many boxes are offered what is over."""
        return len(self.boxes) if self.left else len(self.boxes) - 1

    def _refilled(self, number: int, seconds: float | None) -> bool:
        """Whether a box was filled with more."""
        before, over = self.boxes[number][1], self.left or self.boxes[-1][1]
        box = self._packed([*before, *over], lambda bodies: self.search(bodies, seconds))
        rest = [i for i in (*before, *over) if i not in set(box[1])]
        if not (box[0].certificate.holds and self.worth.more(box[1], before, GAINED * self.volume)):
            return False
        if self.left:
            self.left = rest
        elif not rest:
            self.boxes.pop()
        else:
            again = self._packed(rest, self.place)
            if not again[0].certificate.holds or len(again[1]) < len(rest):
                return False
            self.boxes[-1] = again
        self.boxes[number] = box
        return True

    def _packed(self, indices: list[int], search: Place) -> Box:
        found = search([self.bodies[i] for i in indices])
        return found, [indices[i] for i in found.chosen]
