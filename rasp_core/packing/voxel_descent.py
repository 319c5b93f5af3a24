"""Smaller and smaller boxes by a search among voxels; what it finds is compacted, and kept if it holds.

In a box the search goes on until nothing is shared, or for long no less is; then it begins anew from where least was
shared, with equal weights, and after some of these two bodies change places (as in sparrow, Gardeyn et al. 2025, arXiv
2509.13329). Where that does not help either, it goes on among finer voxels.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .best_box import BestBox
from .compaction import Compaction
from .voxel_bodies import choose_size
from .voxel_search import CELL, VoxelSearch

State = tuple[np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class DescentTuning:
    """How the search goes on."""

    patience: int = 100  # sweeps without less overlap, before it begins anew
    restarts: int = 3  # without less overlap, before two bodies change places
    swaps: int = 2  # in a box, before voxels get finer
    finer: float = 0.6  # times their edge
    finest: float = 0.4  # of the first ones' edge: from there on they stay
    most_memory: float = 2**29  # bytes of the bodies' tables, above which they stay as they are, too
    voxels_at_once: tuple[tuple[int, int], ...] = ((2, 4), (14, 2))  # after so few sweeps the box shrinks by so many


TUNING = DescentTuning()


class VoxelDescent:
    """A search under way, in voxels of an edge in metres. best : the smallest box so far, which it goes on from and
    replaces. free : rotation, translation and edges of what was free and is not compacted yet. disruptions : times so
    far that nothing had helped."""

    def __init__(self, best: BestBox, voxel: float, seed: int) -> None:
        self.best, self.first = best, voxel
        self.random = np.random.default_rng(seed)
        self.search = VoxelSearch(best.bodies, best.shape, voxel, self.random)
        self.compaction = Compaction(best.bodies, best.shape)
        self.disruptions = 0

    def begin(self) -> None:
        """From the best packing so far."""
        self.free: list[State] = []
        poses = self.best.poses
        self.search.begin(poses.rotation.numpy(), poses.translation.numpy(), self.best.edges)
        self._enter()

    def improve(self, late: Callable[[], bool]) -> None:
        """One sweep. late : whether time is over."""
        overlap = self.search.sweep()
        self.sweeps, self.waited = self.sweeps + 1, self.waited + 1
        if overlap == 0:
            self.free.append((*self.search.poses, self.search.edges))
            at_once = next((voxels for most, voxels in TUNING.voxels_at_once if self.sweeps <= most), 1)
            if not all([self.search.shrink() for _ in range(at_once)]):
                self.end(late)
            self._enter()
        elif overlap < self.least:
            self.least, self.state, self.waited, self.restarts = overlap, self.search.state(), 0, 0
        elif self.waited >= TUNING.patience:
            self.waited, self.restarts = 0, self.restarts + 1
            self.search.restore(self.state)
            self.search.forget()
            if self.restarts >= TUNING.restarts:
                self.end(late)
                self._disrupt()

    def end(self, late: Callable[[], bool]) -> None:
        """Compact the smallest box of voxels that was free; if that does not hold, the one before, while these are
        smaller than the best."""
        while self.free:
            rotation, translation, edges = self.free.pop()
            if np.prod(edges) > self.best.least:
                break
            compacted = self.compaction.run(rotation, translation, edges, late)
            if self.best.hold(compacted.poses, compacted.edges):
                break

    def _enter(self) -> None:
        """Begin in another box. stuck : where least was shared there, each time that nothing helped."""
        self.stuck: list[State] = []
        self._start()

    def _start(self) -> None:
        """Begin from where the bodies are. least, state : overlap and places where it was least."""
        self.search.forget()
        self.least, self.state = np.inf, self.search.state()
        self.sweeps = self.waited = self.restarts = 0

    def _disrupt(self) -> None:
        """Two bodies change places where it was stuck now or before; or voxels get finer."""
        self.disruptions += 1
        self.stuck.append(self.state)
        fine = self.search.voxel <= TUNING.finest * self.first
        if len(self.stuck) > TUNING.swaps and not fine and self.search.memory < TUNING.most_memory * TUNING.finer**3:
            bodies, shape = self.best.bodies, self.best.shape
            voxel = choose_size(bodies, shape, TUNING.finer * self.search.voxel)
            # cells that are no smaller, so that a move takes hardly longer, and no more memory
            self.search = VoxelSearch(bodies, shape, voxel, self.random, round(CELL * self.first / voxel))
            self.begin()
            return
        self.search.restore(self.stuck[self.random.integers(len(self.stuck))])
        self.search.swap()
        self._start()
