"""Smaller boxes by the search among voxels (`voxel_descent`): what is free there is compacted, certified and kept."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from .best_box import BestBox
from .compaction import Compaction
from .voxel_descent import Boxed, VoxelDescent

FALLING = 15  # sweeps, in which a box of voxels is free again where all goes well


class Shrinking:
    """A search under way, in voxels of an edge in metres.

    best : the smallest box so far, which it goes on from and replaces. separable : as `VoxelSearch` has it. free : the
    boxes of voxels in which nothing was shared, smaller and smaller, that are not compacted yet.
    """

    def __init__(self, best: BestBox, voxel: float, seed: int, separable: bool = False) -> None:
        self.best = best
        self.descent = VoxelDescent(best.bodies, best.shape, voxel, seed, separable)
        self.compaction = Compaction(best.bodies, best.shape)
        self.free: list[Boxed] = []
        self.waited, self.took = 0, 0.0

    def begin(self) -> None:
        """From the best packing so far."""
        self.free, self.waited = [], 0
        self.descent.begin(self._start)

    def improve(self, late: Callable[[], bool]) -> None:
        """One sweep. late : whether time is over."""
        self.waited += 1
        if (free := self.descent.improve()) is not None:
            self.free.append(free)
            self.waited = 0
        if self.descent.stuck:
            self.end(late)
            self.descent.disrupt(self._start)

    @property
    def seconds(self) -> float:
        """What `end` takes, by the last time that there was something to compact."""
        return self.took if self.free else 0.0

    @property
    def falling(self) -> bool:
        """Whether boxes still get smaller, which costs less than to compact one."""
        return self.waited < FALLING

    def end(self, late: Callable[[], bool]) -> None:
        """Compact the smallest box of voxels that was free; if that does not hold, the one before, while these are
        smaller than the best."""
        began = time.monotonic()
        while self.free:
            free = self.free.pop()
            if np.prod(free.edges) > self.best.least:
                break
            compacted = self.compaction.run(*free, late)
            self.took = time.monotonic() - began
            if self.best.hold(compacted.poses, compacted.edges):
                break

    @property
    def _start(self) -> Boxed:
        poses = self.best.poses
        return Boxed(poses.rotation.numpy(), poses.translation.numpy(), self.best.edges)
