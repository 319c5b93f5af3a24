"""Guided local search in a box too small for all objects: towards less overlap, where nothing need hold.

Again and again two objects change places, or one turns (`moves`), and all are pressed apart as far as they go
(`contact_solver`); what overlaps less is kept. A move is given up as soon as it overlaps much more than the best. If
nothing gets better for some tries, objects that still overlap weigh more from then on, so that the search leaves where
it is stuck (Voudouris & Tsang 1999, Guided local search; Egeblad et al. 2007 pack by it).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..geometry.containers import FreeBox, box
from ..geometry.meshes import Body
from ..geometry.sdf import GridStack
from .contact_solver import Relaxation, Relaxed
from .moves import Moves

TINY = 1e-300


@dataclass(frozen=True)
class LocalSearchTuning:
    """What the search was tuned to."""

    moves_per_try: int = 8  # of which the best may be kept
    reshaped_fraction_of_tries: float = 0.1  # in which free edges change
    reshaping_of_edge: float = 0.01  # by how much: the spread of its logarithm
    sample_spacing_cells: float = 6.0  # between surface samples, in cells of a body's grid
    clearance_of_mean_radius: float = 5e-4  # that each keeps from what is about it
    most_steps: int = 40  # of pressing apart
    steps_before_giving_up: int = 3
    excess_over_best: float = 6.0  # times the least energy: what more a move may have at first
    excess_falls_in_steps: float = 3.5  # e times
    tries_before_weighing: int = 15  # without less overlap


TUNING = LocalSearchTuning()


@dataclass(frozen=True)
class SearchState:
    """Where all bodies lie in a box too small for them.

    rotation `(N, 3, 3)`, translation `(N, 3)` metres, of their centres; edges `(3,)` metres, of the box. energy : that
    of their overlaps, m^4; energy_of_body `(N,)`, each body's part. weight `(N,)` of the bodies in it, 1 in the mean.
    energy_when_grown : what the energy was when the box was last grown, infinite if it was not. tries_without_gain :
    for so many nothing was better.
    """

    rotation: np.ndarray
    translation: np.ndarray
    edges: np.ndarray
    energy: float
    energy_of_body: np.ndarray
    weight: np.ndarray
    energy_when_grown: float = np.inf
    tries_without_gain: int = 0


class GuidedLocalSearch:
    """Searches among the poses of these bodies in boxes of a shape; random : draws the moves.

    rough, fine : press apart by few surface samples, as the search does, and by all.
    """

    def __init__(self, bodies: Sequence[Body], shape: FreeBox, random: np.random.Generator):
        self.bodies, self.shape, self.random = bodies, shape, random
        self.stack = GridStack.of_bodies(bodies)
        self.rough = Relaxation(bodies, TUNING.sample_spacing_cells, self.stack)
        self.clearance = TUNING.clearance_of_mean_radius * float(self.rough.radius.mean())
        self.moves = Moves(bodies, random)

    @cached_property
    def fine(self) -> Relaxation:
        """All surface samples, taken only if asked for."""
        return Relaxation(self.bodies, stack=self.stack)

    def press(
        self,
        solver: Relaxation,
        rotation: np.ndarray,
        translation: np.ndarray,
        edges: np.ndarray,
        weight: np.ndarray | None = None,
    ) -> Relaxed:
        """One arrangement, rotation `(N, 3, 3)`, translation `(N, 3)`, pressed apart to the end in a box."""
        forever = np.full(TUNING.most_steps, np.inf)
        found = solver.run(rotation[None], translation[None], box(edges), self.clearance, forever, weight)
        return found.of(0)

    def begin(self, rotation: np.ndarray, translation: np.ndarray, edges: np.ndarray) -> SearchState:
        """The state that all go into from these poses, pressed into a box of these edges."""
        found = self.press(self.rough, rotation, translation, edges)
        return SearchState(
            rotation=found.rotation,
            translation=found.translation,
            edges=edges,
            energy=float(found.energy),
            energy_of_body=found.energy_of_body,
            weight=np.ones(len(self.bodies)),
        )

    def improve(self, state: SearchState) -> SearchState:
        """The state after one try."""
        edges, rotation, translation = self._moved(state)
        steps = np.arange(TUNING.most_steps)
        ceiling = state.energy * (1 + TUNING.excess_over_best * np.exp(-steps / TUNING.excess_falls_in_steps))
        ceiling[: TUNING.steps_before_giving_up] = np.inf
        found = self.rough.run(rotation, translation, box(edges), self.clearance, ceiling, state.weight)
        best = found.of(int(found.energy.argmin()))
        if best.energy < state.energy:
            return replace(
                state,
                rotation=best.rotation,
                translation=best.translation,
                edges=edges,
                energy=float(best.energy),
                energy_of_body=best.energy_of_body,
                tries_without_gain=0,
            )
        if state.tries_without_gain == TUNING.tries_before_weighing:
            return self._weighed(state)
        return replace(state, tries_without_gain=state.tries_without_gain + 1)

    def _weighed(self, state: SearchState) -> SearchState:
        """The same poses, what overlaps in them weighing more, up to twice as much."""
        weight = state.weight * (1 + state.energy_of_body / max(state.energy_of_body.max(), TINY))
        weight /= weight.mean()
        found = self.press(self.rough, state.rotation, state.translation, state.edges, weight)
        scale = float(found.energy) / max(state.energy, TINY)
        return replace(
            state,
            energy=float(found.energy),
            energy_of_body=found.energy_of_body,
            weight=weight,
            energy_when_grown=state.energy_when_grown * scale,
            tries_without_gain=0,
        )

    def _moved(self, state: SearchState) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The edges of a try's box, and the S poses that it starts from, rotation `(S, N, 3, 3)` and translation
        `(S, N, 3)`: moves, or now and then other free edges."""
        edges, translation, free = state.edges, state.translation, np.flatnonzero(self.shape.free)
        starts: list[tuple[np.ndarray, np.ndarray]] = []
        several = not self.shape.cube and len(free) >= 2
        if several and self.random.random() <= TUNING.reshaped_fraction_of_tries:
            edges, one = edges.copy(), self.random.choice(free)
            longer = np.exp(TUNING.reshaping_of_edge * self.random.standard_normal())
            edges[free] *= longer ** (-1 / (len(free) - 1))
            edges[one] *= longer ** (len(free) / (len(free) - 1))
            translation = translation * (edges / state.edges)
            starts.append((state.rotation, translation))
        while len(starts) < TUNING.moves_per_try:
            starts.append(self.moves.any(state.rotation, translation, state.energy_of_body))
        return edges, np.stack([rotation for rotation, _ in starts]), np.stack([moved for _, moved in starts])
