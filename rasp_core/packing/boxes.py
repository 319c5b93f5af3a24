"""As few boxes as are found for all parts: one filled after the other, then refilled from what is over.

Boxes are alike, or of several kinds that come in a given order, the last one as often as is needed.

Boxes are filled by a placement, which needs no more time than it needs. Then a search, in the time that there is, is
offered a box's objects and those that are over: in no box, or else in the last one. What is worth more stays, and the
rest is over again, until nothing is, or every box has been tried in vain.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

from ..exact.certificate import Certificate
from ..geometry.meshes import Body
from ..util.errors import InputError
from .pool import Worth

LEAST_SECONDS = 1.0  # for one box
GAINED = 1e-9  # of a box's volume: less is no gain


class Packed(Protocol):
    """What a search returns: indices into the pool offered, what proves it, and whether Ctrl-C ended it."""

    chosen: list[int]
    certificate: Certificate
    interrupted: bool


Place = Callable[[Sequence[Body], int], Packed]
Search = Callable[[Sequence[Body], int, float | None], Packed]


class Box(NamedTuple):
    """What is packed into one, the indices of its objects in the pool, and which of the kinds it is."""

    packed: Packed
    indices: list[int]
    kind: int


class Kind(NamedTuple):
    """One kind of box: cubic metres of each, how many there are, None for as many as are needed, and the indices of the
    bodies that are not too large for it, None for all."""

    volume: float
    count: int | None = None
    fitting: set[int] | None = None


def least_number(bodies: Sequence[Body], kinds: Sequence[Kind]) -> int:
    """Boxes that bodies need at least by their own volumes, in the kinds' order; all that there are, if these do not
    hold them."""
    left, number = sum(body.volume for body in bodies) * (1 - 1e-9), 0
    for kind in kinds:
        needed = max(1, math.ceil(left / kind.volume)) if kind.count is None else kind.count
        for _ in range(needed):
            number, left = number + 1, left - kind.volume
            if left <= 0:
                return number
    return number


def fill_boxes(
    place: Place,
    search: Search,
    bodies: Sequence[Body],
    kinds: Sequence[Kind],
    most: int | None = None,
    time_limit: float | None = None,
) -> tuple[list[Box], bool]:
    """The boxes, each with the indices of its objects among `bodies`, in their order there; and whether Ctrl-C ended
    the search, before which there was a box at least.

    place, search : called with bodies and the number of the box's kind, search also with seconds, None without a
    `time_limit` for all; both raise InputError where nothing goes in. kinds : in the order in which they are filled.
    most : boxes, all together; what is then over is in none of them. Raises InputError as the last placement does if
    nothing goes in anywhere.
    """
    filling = _Filling(place, search, list(bodies), kinds, time_limit)
    filling.fill(most)
    try:
        filling.refill()
    except KeyboardInterrupt:
        filling.interrupted = True
    return filling.boxes, filling.interrupted


class _Filling:
    """Boxes under way. left : indices of what is in none of them."""

    def __init__(
        self,
        place: Place,
        search: Search,
        bodies: list[Body],
        kinds: Sequence[Kind],
        time_limit: float | None,
    ):
        self.place, self.search, self.bodies, self.kinds = place, search, bodies, kinds
        self.worth = Worth(bodies)
        self.left = list(range(len(bodies)))
        self.fitting = [set(self.left) if kind.fitting is None else kind.fitting for kind in kinds]
        self.least = least_number(bodies, kinds)
        self.ends = None if time_limit is None else time.monotonic() + time_limit
        self.boxes: list[Box] = []
        self.interrupted = False

    def fill(self, most: int | None) -> None:
        """Box after box, until nothing is left, nothing goes in, or they are as many as are allowed."""
        refused: InputError | None = None
        for number, kind in enumerate(self.kinds):
            for _ in itertools.count() if kind.count is None else range(kind.count):
                if (self.boxes and not self.left) or len(self.boxes) == most or self.interrupted:
                    return
                try:
                    box = self._packed(self.left, number, self.place)
                except InputError as error:
                    refused = error
                    break  # the next kind is perhaps larger
                self.boxes.append(box)
                self.left = [i for i in self.left if i not in set(box.indices)]
                refused = None
        if refused is None:
            return
        if not self.boxes:
            raise refused
        self.left = []  # what goes into no empty box is not offered to others
        self.least = least_number([self.bodies[i] for box in self.boxes for i in box.indices], self.kinds)

    def refill(self) -> None:
        """Offer each box what is over, one after the other, until all have been offered it in vain."""
        number, in_vain = 0, 0
        while not self.interrupted and in_vain < self._others and (self.left or len(self.boxes) > self.least):
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
        before, over, kind = self.boxes[number].indices, self.left or self.boxes[-1].indices, self.boxes[number].kind
        box = self._packed([*before, *over], kind, lambda bodies, kind: self.search(bodies, kind, seconds))
        rest = [i for i in (*before, *over) if i not in set(box.indices)]
        gained = self.worth.more(box.indices, before, GAINED * self.kinds[kind].volume)
        if not (box.packed.certificate.holds and gained):
            return False
        if self.left:
            self.left = rest
        elif not rest:
            self.boxes.pop()
        else:
            if not self.fitting[self.boxes[-1].kind].issuperset(rest):
                return False
            again = self._packed(rest, self.boxes[-1].kind, self.place)
            if not again.packed.certificate.holds or len(again.indices) < len(rest):
                return False
            self.boxes[-1] = again
        self.boxes[number] = box
        return True

    def _packed(self, indices: list[int], kind: int, search: Place) -> Box:
        offered = [i for i in indices if i in self.fitting[kind]]
        if not offered:
            raise InputError("not one of the objects is small enough for the container; enlarge it")
        found = search([self.bodies[i] for i in offered], kind)
        self.interrupted |= found.interrupted
        return Box(found, [offered[i] for i in found.chosen], kind)
