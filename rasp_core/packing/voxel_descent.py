"""Smaller and smaller boxes by a search among voxels; what it finds is compacted, and kept if it holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .best_box import BestBox
from .compaction import Compaction
from .voxel_search import VoxelSearch


@dataclass(frozen=True)
class DescentTuning:
    """How the search goes on."""

    sweeps: int = 100  # in a box, before what was free is compacted, and the search begins anew from there
    voxels_at_once: tuple[tuple[int, int], ...] = ((2, 4), (14, 2))  # after so few sweeps the box shrinks by so many


TUNING = DescentTuning()


class VoxelDescent:
    """A search under way, in voxels of an edge in metres. best : the smallest box so far, which it goes on from and
    replaces."""

    def __init__(self, best: BestBox, voxel: float, seed: int) -> None:
        self.best = best
        self.search = VoxelSearch(best.bodies, best.shape, voxel, np.random.default_rng(seed))
        self.compaction = Compaction(best.bodies, best.shape)

    def begin(self) -> None:
        """From the best packing so far."""
        # rotation, translation and edges of what was free and is not compacted yet
        self.free: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        self.sweeps = 0
        poses = self.best.poses
        self.search.begin(poses.rotation.numpy(), poses.translation.numpy(), self.best.edges)
        self.start = self.search.state()

    def improve(self, late: Callable[[], bool]) -> None:
        """One sweep. late : whether time is over."""
        self.sweeps += 1
        if self.search.sweep() == 0:
            self.free.append((*self.search.poses, self.search.edges))
            self.start = self.search.state()
            at_once = next((voxels for most, voxels in TUNING.voxels_at_once if self.sweeps <= most), 1)
            self.sweeps = 0
            if not all([self.search.shrink() for _ in range(at_once)]):
                self.sweeps = TUNING.sweeps
        if self.sweeps >= TUNING.sweeps:
            self.end(late)
            self.search.restore(self.start)
            self.search.shrink()
            self.search.swap()

    def end(self, late: Callable[[], bool]) -> None:
        """Compact the smallest box of voxels that was free; if that does not hold, the one before, while these are
        smaller than the best."""
        self.sweeps = 0
        while self.free:
            rotation, translation, edges = self.free.pop()
            if np.prod(edges) > self.best.least:
                break
            compacted = self.compaction.run(rotation, translation, edges, late)
            if self.best.hold(compacted.poses, compacted.edges):
                break
