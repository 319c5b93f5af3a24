"""As few equal boxes as are found for all parts: one filled after the other, then the last one given up, if that goes.

The last box holds what is left over. Its parts and those of another box are offered to one box together; where more
goes in than before, the rest goes back into the last one, until that is empty, every other box has been tried in vain,
or time is over.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from ..exact.certificate import Certificate
from ..geometry.meshes import Body
from ..util.errors import InputError

LEAST_SECONDS = 1.0  # for one box
FIRST_DENSITY = 0.5  # that is reckoned with, until a box tells
FILLING = 0.7  # of the time for filling box after box, the rest for giving up the last one
GAINED = 1e-9  # of the volume offered: less is no gain


class Packed(Protocol):
    """What a search returns: indices into the pool offered, and what proves it."""

    chosen: list[int]
    certificate: Certificate


Search = Callable[[Sequence[Body], float | None], Packed]


def least_number(bodies: Sequence[Body], volume: float) -> int:
    """Boxes of a volume in cubic metres that bodies need at least, by their own volumes."""
    return max(1, int(np.ceil(sum(body.volume for body in bodies) / volume * (1 - 1e-9))))


def fill_boxes(
    search: Search, bodies: Sequence[Body], volume: float, most: int | None = None, time_limit: float | None = None
) -> list[tuple[Packed, list[int]]]:
    """For each box what `search` packs into it, and the indices of its objects among `bodies`, in their order there.

    search : called with bodies and seconds, None without a `time_limit` for all boxes together; raises InputError if it
    places nothing. volume : of a box, cubic metres. most : boxes, as many as are needed if None; then what is left over
    is in none of them. Raises InputError as the first search does.
    """
    filling = _Filling(search, list(bodies), volume, time_limit)
    filling.fill(most)
    if most is None or len(filling.boxes) < most or not filling.left:
        filling.give_up_the_last()
    return filling.boxes


class _Filling:
    """Boxes under way. left : indices of what is in none of them."""

    def __init__(self, search: Search, bodies: list[Body], volume: float, time_limit: float | None):
        self.search, self.bodies, self.time_limit = search, bodies, time_limit
        self.volumes, self.volume = np.array([body.volume for body in bodies]), volume
        self.began = time.monotonic()
        self.boxes: list[tuple[Packed, list[int]]] = []
        self.left = list(range(len(bodies)))

    def fill(self, most: int | None) -> None:
        """Box after box, until nothing is left or they are as many as are allowed."""
        density = FIRST_DENSITY
        while (self.left or not self.boxes) and (most is None or len(self.boxes) < most):
            to_come = np.ceil(self._sum(self.left) / (density * self.volume))
            if most is not None:
                to_come = min(to_come, most - len(self.boxes))
            try:
                found, chosen = self._packed(self.left, FILLING, max(1, int(to_come)))
            except InputError:  # none of what is left fits
                if not self.boxes:
                    raise
                return
            self.boxes.append((found, chosen))
            self.left = [i for i in self.left if i not in set(chosen)]
            density = max(self._sum(chosen) / self.volume, 0.1)

    def give_up_the_last(self) -> None:
        """Move what is in the last box into the others, or as much as goes."""
        tried = 0
        while not self.left and tried < len(self.boxes) - 1 and self._seconds(1.0) != 0:
            if len(self.boxes) <= least_number(self.bodies, self.volume):
                return
            number = tried % (len(self.boxes) - 1)
            other, last = self.boxes[number][1], self.boxes[-1][1]
            found, chosen = self._packed([*other, *last], 1.0, 2 * (len(self.boxes) - 1 - tried))
            rest = [i for i in (*other, *last) if i not in set(chosen)]
            if not rest and found.certificate.holds:
                self.boxes[number] = found, chosen
                self.boxes.pop()
                tried = 0
                continue
            tried += 1
            if found.certificate.holds and self._sum(chosen) > self._sum(other) + GAINED * self._sum(chosen):
                again, kept = self._packed(rest, 1.0, 2 * (len(self.boxes) - 1))
                if again.certificate.holds and len(kept) == len(rest):
                    self.boxes[number], self.boxes[-1] = (found, chosen), (again, kept)

    def _packed(self, indices: list[int], share: float, boxes: int) -> tuple[Packed, list[int]]:
        """What is found of some bodies in one box, in its part of the time that is left of a share of the whole."""
        seconds = self._seconds(share)
        seconds = None if seconds is None else max(LEAST_SECONDS, seconds / boxes)
        found = self.search([self.bodies[i] for i in indices], seconds)
        return found, [indices[i] for i in found.chosen]

    def _seconds(self, share: float) -> float | None:
        if self.time_limit is None:
            return None
        return max(0.0, share * self.time_limit - (time.monotonic() - self.began))

    def _sum(self, indices: Sequence[int]) -> float:
        return float(self.volumes[list(indices)].sum())
