"""Boxes of voxels that get smaller and smaller (`voxel_search`), and what is done where the search is stuck.

In a box the search goes on until nothing is shared, or for long no less is; then it begins anew from where least was
shared, with equal weights, and after some of these two bodies change places (as in sparrow, Gardeyn et al. 2025, arXiv
2509.13329). Where that does not help either, it goes on among finer voxels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..geometry.containers import FreeBox
from ..geometry.meshes import Body
from .voxel_bodies import choose_size
from .voxel_search import CELL, VoxelSearch


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


class Boxed(NamedTuple):
    """Bodies in a box about the origin: rotation `(N, 3, 3)`, translation `(N, 3)` and edges `(3,)`, metres."""

    rotation: np.ndarray
    translation: np.ndarray
    edges: np.ndarray


class VoxelDescent:
    """A search under way, in voxels of an edge in metres. separable : as `VoxelSearch` has it. stuck : whether for long
    nothing has helped, or the box cannot get smaller, so that it goes on by `disrupt`."""

    def __init__(
        self, bodies: Sequence[Body], shape: FreeBox, voxel: float, seed: int, separable: bool = False
    ) -> None:
        self.bodies, self.shape, self.first, self.separable = bodies, shape, voxel, separable
        self.random = np.random.default_rng(seed)
        self.search = self._among(voxel)

    def begin(self, start: Boxed) -> None:
        """From bodies in a box, which may overlap."""
        self.search.begin(*start)
        self._enter()

    def improve(self) -> Boxed | None:
        """One sweep. If nothing is shared then, where the bodies are; the box shrinks thereafter."""
        overlap = self.search.sweep()
        self.sweeps, self.waited = self.sweeps + 1, self.waited + 1
        if overlap == 0:
            free = Boxed(*self.search.poses, self.search.edges)
            at_once = next((voxels for most, voxels in TUNING.voxels_at_once if self.sweeps <= most), 1)
            smaller = all([self.search.shrink() for _ in range(at_once)])
            self._enter()
            self.stuck = not smaller
            return free
        if overlap < self.least:
            self.least, self.state, self.waited, self.restarts = overlap, self.search.state(), 0, 0
        elif self.waited >= TUNING.patience:
            self.waited, self.restarts = 0, self.restarts + 1
            self.search.restore(self.state)
            self.search.forget()
            self.stuck = self.restarts >= TUNING.restarts
        return None

    def disrupt(self, best: Boxed) -> None:
        """Two bodies change places where least was shared in this box; or voxels get finer, and it goes on from
        `best`."""
        self.tried.append(self.state)
        fine = self.search.voxel <= TUNING.finest * self.first
        if len(self.tried) > TUNING.swaps and not fine and self.search.memory < TUNING.most_memory * TUNING.finer**3:
            self.search = self._among(choose_size(self.bodies, self.shape, TUNING.finer * self.search.voxel))
            self.begin(best)
            return
        self.search.restore(self.tried[self.random.integers(len(self.tried))])
        self.search.swap()
        self._start()

    def _among(self, voxel: float) -> VoxelSearch:
        # cells that are no smaller in finer voxels, so that a move takes hardly longer, and no more memory
        cell = round(CELL * self.first / voxel)
        return VoxelSearch(self.bodies, self.shape, voxel, self.random, cell, self.separable)

    def _enter(self) -> None:
        """Begin in another box. tried : where least was shared there, each time that nothing helped."""
        self.tried: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        self._start()

    def _start(self) -> None:
        """Begin from where the bodies are. least, state : overlap and places where it was least."""
        self.search.forget()
        self.least, self.state, self.stuck = np.inf, self.search.state(), False
        self.sweeps = self.waited = self.restarts = 0
