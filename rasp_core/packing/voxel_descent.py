"""Smaller and smaller boxes by a search among voxels; what it finds is compacted, and kept if it holds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.containers import FreeBox
from ..geometry.meshes import Body
from ..poses import Poses
from .compaction import Compacted, Compaction
from .voxel_search import VoxelSearch


@dataclass(frozen=True)
class DescentTuning:
    """How the search goes on."""

    sweeps: int = 100  # in a box, before what was free is compacted, and the search begins anew from there
    voxels_at_once: tuple[tuple[int, int], ...] = ((2, 4), (14, 2))  # after so few sweeps the box shrinks by so many


TUNING = DescentTuning()


class VoxelDescent:
    """A search under way.

    hold : takes what was compacted, and says whether it holds and is the best so far.
    """

    def __init__(
        self, bodies: Sequence[Body], shape: FreeBox, voxel: float, seed: int, hold: Callable[[Compacted], bool]
    ) -> None:
        self.search = VoxelSearch(bodies, shape, voxel, np.random.default_rng(seed))
        self.compaction, self.hold = Compaction(bodies, shape), hold

    def begin(self, poses: Poses, edges: np.ndarray) -> None:
        """From a packing in a box of these edges, metres."""
        # rotation, translation and edges of what was free and is not compacted yet
        self.free: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        self.sweeps = 0
        self.search.begin(poses.rotation.numpy(), poses.translation.numpy(), edges)
        self.start = self.search.state()

    def improve(self, least: float, late: Callable[[], bool]) -> None:
        """One sweep. least : cubic metres of the best box so far. late : whether time is over."""
        self.sweeps += 1
        if self.search.sweep() == 0:
            self.free.append((*self.search.poses, self.search.edges))
            self.start = self.search.state()
            at_once = next((voxels for most, voxels in TUNING.voxels_at_once if self.sweeps <= most), 1)
            self.sweeps = 0
            if not all([self.search.shrink() for _ in range(at_once)]):
                self.sweeps = TUNING.sweeps
        if self.sweeps >= TUNING.sweeps:
            self.compact(least, late)
            self.search.restore(self.start)
            self.search.shrink()
            self.search.swap()

    def compact(self, least: float, late: Callable[[], bool]) -> None:
        """Compact the smallest box of voxels that was free; if that does not hold, the one before, while these are
        smaller than the best."""
        self.sweeps = 0
        while self.free:
            rotation, translation, edges = self.free.pop()
            if np.prod(edges) > least or self.hold(self.compaction.run(rotation, translation, late)):
                break
