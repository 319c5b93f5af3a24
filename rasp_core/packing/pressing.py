"""Smaller boxes by pressing: in one a few per cent too small all overlap less and less, until it can grow and hold.

Objects are moved by `guided_local_search`. When much less overlaps the box grows until nothing does, by samples, then
by exact booleans. What is smaller than the best is kept, and the box is made too small again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import torch

from ..exact.overlap_removal import REPAIRABLE_FRACTION
from ..poses import Poses
from .best_box import BestBox
from .guided_local_search import GuidedLocalSearch, SearchState


@dataclass(frozen=True)
class PressingTuning:
    """What pressing was tuned to."""

    too_small_by_of_volume: float = 0.05  # the box searched in, against the best
    grown_at_energy: float = 0.75  # of what it was when the box was last grown
    easily_smaller_by_of_volume: float = 0.01  # made too small and grown again at once
    growth_of_volume: float = 0.002  # at once, times a power of how far the energy is from being free of overlap
    growth_power: float = 0.4
    free_rough_energy: float = 1e-6  # of `Relaxation.unit`: by few samples, what booleans may take away
    free_fine_energy: float = 5e-7  # by all samples


TUNING = PressingTuning()


class Pressing:
    """A search under way. best : the smallest box so far, which it goes on from and replaces. ending : whether little
    time is left, so that the box is grown at any lower energy."""

    falling, seconds = False, 0.0  # its turns are as long as they are, and end at once

    def __init__(self, best: BestBox, seed: int, ending: Callable[[], bool]) -> None:
        self.best, self.ending = best, ending
        self.search = GuidedLocalSearch(best.bodies, best.shape, np.random.default_rng(seed))

    def begin(self) -> None:
        """From the best packing so far."""
        poses = self.best.poses
        self.state = self._too_small(poses.rotation.numpy(), poses.translation.numpy(), self.best.edges)

    def improve(self, late: Callable[[], bool]) -> None:
        """Move one or two bodies to have less overlap in a box that is too small; it is grown if that came off."""
        state = self.search.improve(self.state)
        if state.energy < (1.0 if self.ending() else TUNING.grown_at_energy) * state.energy_when_grown:
            state = self._grown(state, late)
        self.state = state

    def end(self, late: Callable[[], bool]) -> None:
        """Nothing is left to be done."""

    def _too_small(self, rotation: np.ndarray, translation: np.ndarray, edges: np.ndarray) -> SearchState:
        """All, in a box of these edges, pressed into one that is smaller than the best."""
        small = self._scaled(self.best.edges, 1 - TUNING.too_small_by_of_volume)
        return self.search.begin(rotation, translation * (small / edges), small)

    def _grown(self, state: SearchState, late: Callable[[], bool]) -> SearchState:
        """Grow the box until all hold; the state to go on from, in a box too small again if it is the best."""
        search, edges, energy = self.search, state.edges, state.energy
        rotation, translation = state.rotation, state.translation
        while not late():
            soft = max(1.0, energy / (TUNING.free_rough_energy * search.rough.unit)) ** TUNING.growth_power
            larger = self._scaled(edges, 1 + TUNING.growth_of_volume * soft)
            if np.prod(larger) >= self.best.least:
                break
            translation, edges = translation * (larger / edges), larger
            solvers = (search.rough, TUNING.free_rough_energy), (search.fine, TUNING.free_fine_energy)
            for solver, free in solvers:
                pressed = search.press(solver, rotation, translation, edges)
                energy, rotation, translation = pressed.energy, pressed.rotation, pressed.translation
                if energy > free * solver.unit:
                    break
            else:
                before = self.best.least
                poses = Poses(torch.from_numpy(rotation), torch.from_numpy(translation))
                if self.best.hold(poses, edges, REPAIRABLE_FRACTION):
                    again = self._too_small(state.rotation, state.translation, state.edges)
                    easily = self.best.least < before * (1 - TUNING.easily_smaller_by_of_volume)
                    return again if easily else replace(again, energy_when_grown=again.energy)
        return replace(state, energy_when_grown=state.energy)

    def _scaled(self, edges: np.ndarray, factor: float) -> np.ndarray:
        """Edges of a box whose volume is so many times as large."""
        free = self.best.shape.free
        return np.where(free, edges * factor ** (1 / free.sum()), edges)
