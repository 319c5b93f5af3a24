"""The smallest box that holds all objects: the container as an unknown.

1. A baseline places all of them, the largest first, in a box that grows along its free edges until it holds them: a
   first answer.
2. Among voxels objects are moved one by one to where they share least, in a box that shrinks by a voxel whenever they
   share nothing; a linear programme then takes out what voxels do not see and makes the box smaller (`voxel_descent`).
3. In a box a few per cent too small all are pressed apart as far as they go, and moved towards less overlap
   (`guided_local_search`); when much less overlaps the box grows until nothing does, by samples, then by booleans.
4. Both take turns; the one that gained more in its last one goes on. What is certified and smaller than the best is
   kept, so that there is a packing at any time.

The question is that of Gupta & Raman 2026, Differentiable Packing of Irregular 3D Objects with Adaptive Container
Estimation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import torch

from ..exact.certificate import certify
from ..exact.overlap_removal import REPAIR_TOLERANCE, REPAIRABLE_FRACTION, remove_overlaps
from ..geometry.containers import Container, FreeBox, box
from ..geometry.growing import shrunk
from ..geometry.meshes import Body
from ..poses import Poses, file_to_world
from ..problem import Settings
from ..util.budget import Budget
from ..util.devices import resolve_device
from ..util.errors import InputError
from ..util.progress import progress_bar
from .constructive import Placement
from .enclosing_box import enclosing_box
from .guided_local_search import GuidedLocalSearch, SearchState
from .result import Packing, finish

if TYPE_CHECKING:
    from .compaction import Compacted
    from .voxel_descent import VoxelDescent


@dataclass(frozen=True)
class BoxTuning:
    """What the search for a box was tuned to."""

    tries: int = 2000  # if neither time nor effort is given
    most_among_voxels: int = 250  # bodies, of which the linear programmes are solved in seconds
    turns: int = 10  # that voxels and pressing take, or one of them alone
    turns_end_at: float = 0.97  # of the budget, the last one
    voxel_of_likely_edge: float = 1 / 64  # of a cube as dense as is likely
    likely_density: float = 0.6
    first_density: float = 0.5  # of the box in which the placement of all begins
    replaced_volume_of_best: float = 0.97  # of the box in which a further placement begins
    too_small_by_of_volume: float = 0.05  # the box searched in, against the best
    grown_at_energy: float = 0.75  # of what it was when the box was last grown
    last_fraction_of_budget: float = 0.02  # in which the box is grown at any lower energy
    easily_smaller_by_of_volume: float = 0.01  # made too small and grown again at once
    growth_of_volume: float = 0.002  # at once, times a power of how far the energy is from being free of overlap
    growth_power: float = 0.4
    free_rough_energy: float = 1e-6  # of `Relaxation.unit`: by few samples, what booleans may take away
    free_fine_energy: float = 5e-7  # by all samples
    negligible_of_volume: float = 1e-6  # what may be left


TUNING = BoxTuning()


def pack(
    bodies: Sequence[Body],
    shape: FreeBox,
    settings: Settings | None = None,
    device: str | torch.device = "cpu",
    time_limit: float | None = None,
    effort: int | None = None,
    progress: bool = False,
    rule: str | None = None,
) -> Packing:
    """All `bodies` in the smallest box of a shape that is found, certified.

    rule : None for the search above; a name of `constructive.RULES` for that baseline alone, placing all in shaken
    orders until time is over. time_limit : seconds. effort : number of tries (further placements, for a rule), 2000
    (none) if neither is given. settings : seed and resolution count. Ctrl-C and the time limit return the best so far,
    but for the first placement, which is made in any case.

    bodies : one at least, each of a size that some box with the fixed edges holds. Raises InputError for a negative
    effort.
    """
    settings = settings or Settings()
    if effort is None and time_limit is None:
        effort = TUNING.tries if rule is None else 0
    budget = Budget(time_limit, effort)
    search = _Search(bodies, shape, settings, device, budget, progress, rule)
    try:
        search.place()
        while not budget.over() and not search.full:
            search.place_again() if rule else search.improve()
    except KeyboardInterrupt:
        if search.container is None:
            raise
        search.interrupted = True
    finally:
        search.bar.close()
    return search.result()


class _Search:
    """A search under way. container, poses : the smallest box so far, and where all bodies lie in it and hold.

    state : in a box too small; None before the first try.
    """

    def __init__(
        self,
        bodies: Sequence[Body],
        shape: FreeBox,
        settings: Settings,
        device: str | torch.device,
        budget: Budget,
        progress: bool,
        rule: str | None,
    ):
        self.bodies, self.shape, self.settings, self.rule = list(bodies), shape, settings, rule
        self.device = resolve_device(device)
        self.budget = budget
        self.volumes = np.array([body.volume for body in bodies])
        self.container: Container | None = None
        self.poses: Poses | None = None
        self.state: SearchState | None = None
        self.means, self.turn = "voxels" if len(bodies) <= TUNING.most_among_voxels else "pressing", 1
        self.gains = {"voxels": np.inf, "pressing": np.inf}  # of the logarithm of the volume, in the last turn
        self.interrupted = False
        self.rounds: list[dict] = []
        self.bar = progress_bar(f"smallest box, {rule or 'dense'}", "try", progress, budget.effort)

    # -- placing -----------------------------------------------------------------------------------------------------

    def place(self) -> None:
        """The first box, by a baseline."""
        first = self.shape.sized(self.volumes.sum() / TUNING.first_density)
        self.placement = Placement(self.bodies, box(first), self.settings.seed, self.rule or "spectral", straight=True)
        if self.placement.coarse:  # cubes may leave nothing between them, and growing costs little
            self.placement.enter(box(self.shape.sized(self.volumes.sum())))
        self._place_in_growing_box(None)

    def place_again(self) -> None:
        """Place anew in a shaken order; the box starts a little below the best."""
        self.budget.tries += 1
        self.bar.update()
        self.placement.enter(box(self.shape.sized(TUNING.replaced_volume_of_best * self.container.volume)))
        self._place_in_growing_box(self.placement.shaken())

    def _place_in_growing_box(self, order: np.ndarray | None) -> None:
        """Place all, the box growing by a voxel at a time; given up if it would be no smaller than the best, and, if
        there is a best, when time is over."""
        longest, edges = _longest(self.bodies), self.placement.container.size

        def late() -> bool:
            return self.container is not None and self.budget.spent()

        while True:
            self.placement.fill(order, late)
            if len(self.placement.placed) == len(self.bodies):
                break
            shortest = np.arange(3) == np.where(self.shape.free, edges, np.inf).argmin()
            edges = edges + self.placement.room.voxel * (self.shape.free if self.shape.cube else shortest)
            if np.prod(edges) >= self.least or late():
                return
            if edges[self.shape.free].min() > (longest + 2 * self.placement.room.voxel) * len(self.bodies):
                raise InputError("not all objects fit between the fixed edges; make them longer, or free them with *")
            self.placement.enter(box(edges), keep=True)
        backwards = np.argsort(list(self.placement.placed))
        self._keep(self.placement.poses.take(backwards))
        self.least_before = self.least

    # -- in a box too small ------------------------------------------------------------------------------------------

    @cached_property
    def local_search(self) -> GuidedLocalSearch:
        return GuidedLocalSearch(self.bodies, self.shape, np.random.default_rng(self.settings.seed))

    @cached_property
    def descent(self) -> VoxelDescent:
        from .voxel_descent import VoxelDescent
        from .voxel_search import choose_size

        voxel = self.placement.room.voxel
        if not self.placement.coarse:
            likely = float(self.volumes.sum() / TUNING.likely_density) ** (1 / 3)
            voxel = choose_size(self.bodies, self.shape, TUNING.voxel_of_likely_edge * likely)
        descent = VoxelDescent(self.bodies, self.shape, voxel, self.settings.seed, self._hold)
        descent.begin(self.poses, self.container.size)
        return descent

    def improve(self) -> None:
        """One try by the means whose turn it is."""
        self.budget.tries += 1
        self.bar.update()
        if self.means == "voxels":
            self.descent.improve(self.least, self.budget.spent)
        else:
            self._press()
        if self.budget.over(TUNING.turns_end_at * self.turn / TUNING.turns):
            self._take_turns()

    def _take_turns(self) -> None:
        """Next comes the means that gained more in its last turn, from the best so far if it is another."""
        if self.means == "voxels":
            self.descent.compact(self.least, self.budget.spent)
        other = "pressing" if self.means == "voxels" else "voxels"
        self.turn, self.gains[self.means] = self.turn + 1, np.log(self.least_before / self.least)
        self.least_before = self.least
        if self.gains[other] < self.gains[self.means] or len(self.bodies) > TUNING.most_among_voxels:
            return
        self.means, self.state = other, None
        if other == "voxels":
            self.descent.begin(self.poses, self.container.size)

    def _hold(self, compacted: Compacted) -> bool:
        """Whether what is compacted is a smaller box in which all hold, after exact booleans; it is kept then."""
        poses = Poses(torch.from_numpy(compacted.rotation), torch.from_numpy(compacted.translation))
        held = remove_overlaps(self.bodies, poses, box(compacted.edges), REPAIR_TOLERANCE)
        return held is not None and self._keep(held, compacted.edges)

    def _press(self) -> None:
        """Move one or two bodies to have less overlap in a box that is too small; it is grown if that came off."""
        state = self.state
        if state is None:
            rotation, translation = self.poses.rotation.numpy(), self.poses.translation.numpy()
            state = self._too_small(rotation, translation, self.container.size)
        state = self.local_search.improve(state)
        late = self.budget.over(1 - TUNING.last_fraction_of_budget)
        if state.energy < (1.0 if late else TUNING.grown_at_energy) * state.energy_when_grown:
            state = self._grown(state)
        self.state = state

    def _too_small(self, rotation: np.ndarray, translation: np.ndarray, edges: np.ndarray) -> SearchState:
        """All, in a box of these edges, pressed into one that is smaller than the best."""
        small = self._scaled(self.container.size, 1 - TUNING.too_small_by_of_volume)
        return self.local_search.begin(rotation, translation * (small / edges), small)

    def _grown(self, state: SearchState) -> SearchState:
        """Grow the box until all hold; the state to go on from, in a box too small again if it is the best."""
        search, edges, energy = self.local_search, state.edges, state.energy
        rotation, translation = state.rotation, state.translation
        while not self.budget.spent():
            soft = max(1.0, energy / (TUNING.free_rough_energy * search.rough.unit)) ** TUNING.growth_power
            larger = self._scaled(edges, 1 + TUNING.growth_of_volume * soft)
            if np.prod(larger) >= self.least:
                break
            translation, edges = translation * (larger / edges), larger
            solvers = (search.rough, TUNING.free_rough_energy), (search.fine, TUNING.free_fine_energy)
            for solver, free in solvers:
                pressed = search.press(solver, rotation, translation, edges)
                energy, rotation, translation = pressed.energy, pressed.rotation, pressed.translation
                if energy > free * solver.unit:
                    break
            else:
                before = self.least
                poses = Poses(torch.from_numpy(rotation), torch.from_numpy(translation))
                held = remove_overlaps(self.bodies, poses, box(edges), REPAIR_TOLERANCE, REPAIRABLE_FRACTION)
                if held is not None and self._keep(held, edges):
                    again = self._too_small(state.rotation, state.translation, state.edges)
                    easily = self.least < before * (1 - TUNING.easily_smaller_by_of_volume)
                    return again if easily else replace(again, energy_when_grown=again.energy)
        return replace(state, energy_when_grown=state.energy)

    def _scaled(self, edges: np.ndarray, factor: float) -> np.ndarray:
        """Edges of a box whose volume is so many times as large."""
        return np.where(self.shape.free, edges * factor ** (1 / self.shape.free.sum()), edges)

    # -- the record --------------------------------------------------------------------------------------------------

    @property
    def least(self) -> float:
        """Volume of the smallest box so far, cubic metres."""
        return np.inf if self.container is None else self.container.volume

    @property
    def full(self) -> bool:
        """Nothing is left to gain."""
        return self.least <= self.volumes.sum() * (1 + TUNING.negligible_of_volume)

    def _keep(self, poses: Poses, edges: np.ndarray | None = None) -> bool:
        """Certify all at some poses, in the box that just holds them or in that of these edges, the smaller; kept, and
        True, if it holds and is smaller than the best."""
        container, poses = enclosing_box(self.bodies, poses, self.shape, edges)
        if container.volume >= self.least:
            return False
        matrices = file_to_world(self.bodies, poses.rotation, poses.translation)
        holds = certify(self.bodies, matrices, container).holds
        if holds:
            self.container, self.poses = container, poses
            edges = container.size + 2 * self.shape.margin
            density = float(self.volumes.sum() / edges.prod())
            self.rounds.append({"tries": self.budget.tries, "box": edges.tolist(), "density": density})
            self.bar.set_postfix_str(f"{' x '.join(f'{e:.4f}' for e in edges)} m, density {density:.4f}")
        return holds

    def result(self) -> Packing:
        """The smallest box, certified anew."""
        return finish(
            self.bodies,
            list(range(len(self.bodies))),
            self.poses,
            self.container,
            self.settings,
            self.device,
            rounds=self.rounds,
            interrupted=self.interrupted,
        )


def largest_box(bodies: Sequence[Body], shape: FreeBox) -> Container:
    """A box of the shape in which bodies that fit into none such do not fit, see `pool.check_sizes`."""
    edges = np.array([_longest(bodies) if edge is None else edge for edge in shape.edges])
    return shrunk(box(edges + 2 * shape.margin), shape.margin)


def _longest(bodies: Sequence[Body]) -> float:
    """A length in metres that no body exceeds, however it is turned."""
    return max((2 * body.radius for body in bodies), default=1.0)
