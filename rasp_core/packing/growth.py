"""A packing that holds made denser, object by object.

Again and again an object of the pool goes where it overlaps least, alone or for a smaller one that is taken out
(`insertion`), and all are pressed apart (`separation`). What holds and is denser is kept, everything else forgotten, so
that there is a certified packing at any time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.containers import Container
from ..geometry.meshes import Body
from .insertion import Voids
from .layout import Layout
from .pool import Worth
from .separation import Separation


@dataclass(frozen=True)
class GrowthTuning:
    """What growing was tuned to."""

    moves_per_try: int = 24  # of which the most promising is tried
    swap_fraction_of_moves: float = 0.7  # in which an object is taken out for a larger one
    most_inserted_at_once: int = 16  # twice as many after each success, half after each failure
    # of a mean object's volume: what is shared by so much is pressed apart e times less often
    least_yielding_of_mean_volume: float = 1e-4
    most_yielding_of_mean_volume: float = 0.02
    pull_of_rank: float = 3.0  # on the logarithm of a gain, for each rank of the object that comes
    yielding_after_success: float = 1.3  # times what it was
    yielding_after_failure: float = 0.8


TUNING = GrowthTuning()


class Growth:
    """Grows packings of one pool in one container.

    random : draws the moves. seed : of what presses apart. kept : called with each layout that is kept.
    """

    def __init__(
        self,
        pool: Sequence[Body],
        container: Container,
        separation: Separation,
        random: np.random.Generator,
        seed: int,
        kept: Callable[[Layout], None],
    ):
        self.pool, self.container, self.separation = list(pool), container, separation
        self.random, self.seed, self.kept = random, seed, kept
        self.voids = Voids(pool, container, separation.device, random, separation.stack)
        self.worth = Worth(pool)
        self.rank, self.volumes = self.worth.rank, self.worth.volumes / container.volume
        self.inserted_at_once, self.yielding = 1, TUNING.most_yielding_of_mean_volume

    def improve(self, layout: Layout, number: int) -> Layout:
        """The layout after one try, the try's number; at least as dense."""
        proposal = self._propose(layout) if self.inserted_at_once == 1 else self._propose_many(layout)
        separated = None if proposal is None else self._separate(layout, proposal, number)
        before = len(layout)
        if separated is not None and not self.worth.more(layout.chosen, separated.chosen):
            layout = separated
            self.kept(layout)
        self._learn(succeeded=separated is not None, grown=len(layout) > before)
        return layout

    def _learn(self, succeeded: bool, grown: bool) -> None:
        """What to try next, after a try that came to hold or did not, and that left more objects in or did not."""
        factor = TUNING.yielding_after_success if succeeded else TUNING.yielding_after_failure
        least, most = TUNING.least_yielding_of_mean_volume, TUNING.most_yielding_of_mean_volume
        self.yielding = float(np.clip(self.yielding * factor, least, most))
        once = self.inserted_at_once
        self.inserted_at_once = min(2 * once, TUNING.most_inserted_at_once) if grown else max(1, once // 2)

    def _propose(self, layout: Layout) -> Layout | None:
        """The most promising of some moves: what it gains, times the chance that what it shares with the others where
        it is put can be pressed out."""
        found, best = None, -np.inf
        mean, occupancy = self.volumes.mean(), self.voids.occupancy(layout)
        for _ in range(TUNING.moves_per_try):
            out, index = self._move(layout)
            if index is None:
                continue
            there = self.voids.occupancy_without(occupancy, out)
            insertion = self.voids.least_shared(there, [index], self.voids.most_shared)
            if insertion is None:
                continue
            lost = None if out is None else layout.chosen[out]
            promoted = lost is not None and self.rank[index] > self.rank[lost]
            gain = self.volumes[index] - (0 if lost is None or promoted else self.volumes[lost])
            promise = (
                self.rank[index] * TUNING.pull_of_rank
                + np.log(gain)
                - insertion.shared / self.container.volume / (self.yielding * mean)
            )
            if promise > best:
                found, best = layout.without(out).added(index, insertion.pose), promise
        return found

    def _propose_many(self, layout: Layout) -> Layout | None:
        """Several objects more, while there are voids for them."""
        filled = self.voids.fill(layout, self.inserted_at_once)
        return filled if len(filled) > len(layout) else None

    def _move(self, layout: Layout) -> tuple[int | None, int | None]:
        """The position in the layout of an object that is taken out, None for none, and the index of one that may come,
        larger; None for none."""
        out, least, chosen = None, 0.0, layout.chosen
        if chosen and self.random.random() < TUNING.swap_fraction_of_moves:
            out = int(self.random.integers(len(chosen)))
            least = self.volumes[chosen[out]]
        rest = np.setdiff1d(np.arange(len(self.pool)), chosen)
        larger = self.volumes[rest] > least * (1 + 1e-6)
        if self.rank.any() and out is not None:
            above = self.rank[rest] - self.rank[chosen[out]]
            larger = (above > 0) | ((above == 0) & larger)
        rest = rest[larger & (self.volumes[rest] < least + 2 * self.volumes.mean())]
        return out, int(self.random.choice(rest)) if len(rest) else None

    def _separate(self, layout: Layout, proposal: Layout, number: int) -> Layout | None:
        """Press the objects apart until the certificate holds; None if it does not come to that."""
        movers = self.voids.neighbours(proposal, inserted=max(1, len(proposal) - len(layout)))
        return self.separation.separate(proposal, self.seed + number, movers)
