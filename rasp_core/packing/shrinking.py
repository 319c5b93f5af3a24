"""Smaller boxes by the search among voxels (`voxel_descent`): what is free there is compacted, certified and kept."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .best_box import BestBox
from .compaction import Compaction
from .voxel_descent import Boxed, VoxelDescent


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

    def begin(self) -> None:
        """From the best packing so far."""
        self.free = []
        self.descent.begin(self._start)

    def improve(self, late: Callable[[], bool]) -> None:
        """One sweep. late : whether time is over."""
        if (free := self.descent.improve()) is not None:
            self.free.append(free)
        if self.descent.stuck:
            self.end(late)
            self.descent.disrupt(self._start)

    def end(self, late: Callable[[], bool]) -> None:
        """Compact the smallest box of voxels that was free; if that does not hold, the one before, while these are
        smaller than the best."""
        while self.free:
            free = self.free.pop()
            if np.prod(free.edges) > self.best.least:
                break
            compacted = self.compaction.run(*free, late)
            if self.best.hold(compacted.poses, compacted.edges):
                break

    @property
    def _start(self) -> Boxed:
        poses = self.best.poses
        return Boxed(poses.rotation.numpy(), poses.translation.numpy(), self.best.edges)
