"""More objects than a box is known to hold, in one as wide but higher, whose top is lowered until it is the box's.

What lowers it is the search for the smallest box among voxels (`voxel_descent`), which is good at copies that nest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..exact.overlap_removal import held_without
from ..geometry.containers import Container, FreeBox, box
from ..geometry.meshes import Body
from .compaction import MOST_BODIES, Compaction
from .layout import Layout
from .pool import Worth, kind
from .voxel_bodies import first_size

if TYPE_CHECKING:
    from .voxel_descent import Boxed, VoxelDescent


@dataclass(frozen=True)
class LoweringTuning:
    """How many objects more are tried, and when it is given up."""

    copies: float = 3.0  # of each kind in the mean, from which on it is worth it
    more_of_volume: float = 0.1  # that is packed: of what comes to it, at first
    more_after_success: float = 1.5  # times as much
    more_after_failure: float = 0.5
    least_more: float = 0.04  # so that a few that do not go may be left out
    higher: float = 1.1  # times what the objects more would need if they were packed as the others are
    from_above: float = 1.0  # voxels above the top, from which on overlaps are taken out
    apart_of_radius: float = 1e-3  # that is left between objects if there is room
    disruptions: int = 3  # without success, after which it is given up


TUNING = LoweringTuning()


def is_worth(pool: Sequence[Body], container: Container) -> bool:
    """Whether objects of the pool are copies, and the container a box without zones."""
    return (
        container.base.size is not None
        and not container.zones
        and len(pool) >= TUNING.copies * len({kind(body) for body in pool})
    )


class Lowering:
    """A search under way.

    cubes : edge of the equal cubes of which all objects are made, None if they are not. kept : called with each layout
    that holds more than the one before.
    """

    def __init__(
        self,
        pool: Sequence[Body],
        container: Container,
        cubes: float | None,
        random: np.random.Generator,
        kept: Callable[[Layout], None],
    ) -> None:
        self.pool, self.size, self.cubes, self.random, self.kept = list(pool), container.base.size, cubes, random, kept
        self.shape = FreeBox((self.size[0], self.size[1], None))
        self.worth = Worth(pool)
        self.more = TUNING.more_of_volume
        self.descent: VoxelDescent | None = None

    def improve(self, layout: Layout, late: Callable[[], bool]) -> None:
        """One sweep; it goes on with what is under way as long as that is more than the layout. late : whether time is
        over."""
        if self.descent is None or not self.worth.more(self.chosen, layout.chosen):
            if not 0 < len(layout) < MOST_BODIES:
                return
            self._begin(layout)
        free, found = self.descent.improve(), None
        if free is not None:
            self.start = free
            low = free.edges[2] <= self.size[2] + TUNING.from_above * self.descent.search.voxel
            found = self._held(free, layout, late) if low else None
        if found is not None:
            self.more *= TUNING.more_after_success if len(found) == len(self.chosen) else 1.0
            self.descent = None
            self.kept(found)
        elif self.descent.stuck:
            self.disruptions += 1
            if self.disruptions < TUNING.disruptions or self._alike():
                self.descent.disrupt(self.start)
                return
            self.more = max(TUNING.more_after_failure * self.more, TUNING.least_more)
            self.descent = None

    def _held(self, at: Boxed, layout: Layout, late: Callable[[], bool]) -> Layout | None:
        """Overlaps taken out in the container, and what they do not go without; None if that leaves no more than in the
        layout."""
        free = self.compaction.run(at.rotation, at.translation, self.size, late)
        if late():
            return None
        held = held_without(self.bodies, free.poses, box(self.size), len(self.extra), late)
        found = None if held is None else Layout([self.chosen[i] for i in held[0]], held[1])
        return found if found is not None and self.worth.more(found.chosen, layout.chosen) else None

    def _begin(self, layout: Layout) -> None:
        """From a layout that holds, and more objects about above it."""
        from .voxel_descent import Boxed, VoxelDescent

        extra = self._chosen(layout)
        self.extra, self.chosen, self.disruptions = extra, [*layout.chosen, *extra], 0
        before, all_of_it = self.worth.volume(layout.chosen), self.worth.volume(self.chosen)
        height = self.size[2] * (1 + TUNING.higher * (all_of_it / before - 1))
        below = layout.poses.translation.numpy() - [0, 0, (height - self.size[2]) / 2]
        places = self.random.uniform(-0.5, 0.5, (len(extra), 3)) * [*self.size[:2], height - self.size[2]]
        places[:, 2] += self.size[2] / 2
        turned = np.tile(np.eye(3), (len(extra), 1, 1))
        rotation = np.concatenate([layout.poses.rotation.numpy(), turned])
        self.start = Boxed(rotation, np.concatenate([below, places]), self.shape.lengths(height))
        self.bodies = [self.pool[i] for i in self.chosen]
        self.compaction = Compaction(self.bodies, FreeBox(tuple(self.size)), TUNING.apart_of_radius)
        taken = sum(body.taken for body in self.bodies)
        voxel = first_size(self.bodies, self.shape, taken, self.cubes)
        self.descent = VoxelDescent(self.bodies, self.shape, voxel, int(self.random.integers(2**31)))
        self.descent.begin(self.start)

    def _chosen(self, layout: Layout) -> list[int]:
        """What is to come in, one object at least: what ranks first, else by chance."""
        rest = np.setdiff1d(np.arange(len(self.pool)), layout.chosen)
        order = self.worth.first(self.random.permutation(rest))
        wanted = self.more * self.worth.volume(layout.chosen)
        count = 1 + int(np.searchsorted(np.cumsum(self.worth.volumes[order]), wanted))
        return [int(i) for i in order[: min(count, MOST_BODIES - len(layout))]]

    def _alike(self) -> bool:
        """Whether another try would be the same: one object more, and all that could come in are copies of it."""
        over = {*range(len(self.pool))} - {*self.chosen} | {*self.extra}
        return len(self.extra) == 1 and len({kind(self.pool[i]) for i in over}) == 1
