"""The smallest box that holds all objects: the container as an unknown.

1. A baseline places all of them, the largest first, in a box that grows along its free edges until it holds them: a
   first answer.
2. Among voxels objects are moved one by one to where they share least, in a box that shrinks by a voxel whenever they
   share nothing; a linear programme then takes out what voxels do not see and makes the box smaller (`shrinking`).
3. In a box a few per cent too small all are pressed apart as far as they go, and moved towards less overlap; when much
   less overlaps the box grows until nothing does, by samples, then by booleans (`pressing`).
4. Both take turns; the one that gained more in its last one goes on. What is certified and smaller than the best is
   kept, so that there is a packing at any time. Where zones are kept out, only some turns are wished, or the packing is
   to come apart, there is no pressing.

The question is that of Gupta & Raman 2026, Differentiable Packing of Irregular 3D Objects with Adaptive Container
Estimation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import torch

from ..geometry.containers import Container, FreeBox, box
from ..geometry.growing import shrunk
from ..geometry.meshes import Body
from ..geometry.zones import box_of
from ..poses import freedom_of
from ..problem import Settings
from ..util.budget import Budget
from ..util.devices import resolve_device
from ..util.errors import InputError
from ..util.progress import progress_bar
from .best_box import BestBox
from .compaction import MOST_BODIES
from .constructive import Placement
from .pressing import Pressing
from .result import Packing, finish
from .turns import Turns
from .voxel_bodies import first_size

if TYPE_CHECKING:
    from .shrinking import Shrinking


@dataclass(frozen=True)
class BoxTuning:
    """What the search for a box was tuned to."""

    tries: int = 2000  # if neither time nor effort is given
    first_density: float = 0.5  # of the box in which the placement of all begins
    first_voxels_coarser: float = 2.0  # times a baseline's: objects are placed among these if others are next
    replaced_volume_of_best: float = 0.97  # of the box in which a further placement begins
    last_fraction_of_budget: float = 0.02  # in which pressing takes what it can get
    negligible_of_volume: float = 1e-6  # what may be left


TUNING = BoxTuning()
TOO_NARROW = "not all objects fit between the fixed edges; make them longer, or free them with *"


def pack(
    bodies: Sequence[Body],
    shape: FreeBox,
    settings: Settings | None = None,
    device: str | torch.device = "cpu",
    time_limit: float | None = None,
    effort: int | None = None,
    progress: bool = False,
    rule: str | None = None,
    separable: bool = False,
) -> Packing:
    """All `bodies` in the smallest box of a shape that is found, certified.

    rule : None for the search above; a name of `constructive.RULES` for that baseline alone, placing all in shaken
    orders until time is over. time_limit : seconds. effort : number of tries (further placements, for a rule), 2000
    (none) if neither is given. settings : seed and resolution count. separable : the search leaves nothing under an
    overhang, so that hardly anything locks. Ctrl-C and the time limit return the best so far, but for the first
    placement, which is made in any case.

    bodies : one at least, each of a size that some box with the fixed edges holds. Raises InputError for a negative
    effort.
    """
    settings = settings or Settings()
    if effort is None and time_limit is None:
        effort = TUNING.tries if rule is None else 0
    budget = Budget(time_limit, effort)
    search = _Search(bodies, shape, settings, device, budget, progress, rule, separable)
    try:
        search.place()
        while not budget.over() and not search.full:
            search.place_again() if search.rule else search.improve()
    except KeyboardInterrupt:
        if search.best.container is None:
            raise
        search.interrupted = True
    finally:
        search.bar.close()
    return search.result()


class _Search:
    """A search under way. best : the smallest box so far. turns : of its means, which gain of the logarithm of the
    volume."""

    def __init__(
        self,
        bodies: Sequence[Body],
        shape: FreeBox,
        settings: Settings,
        device: str | torch.device,
        budget: Budget,
        progress: bool,
        rule: str | None,
        separable: bool = False,
    ):
        self.bodies, self.shape, self.settings, self.rule = list(bodies), shape, settings, rule
        self.separable, self.least_before = separable, None
        self.device = resolve_device(device)
        self.budget = budget
        self.best = BestBox(self.bodies, shape, self._note)
        means = ["shrinking"] if len(self.bodies) <= MOST_BODIES else []
        if not (shape.zones or separable) and freedom_of(self.bodies) is None:  # which pressing does not heed
            means.append("pressing")
        if not means:
            self.rule = self.rule or "spectral"
        self.turns = Turns(means, budget)
        self.interrupted = False
        self.rounds: list[dict] = []
        self.bar = progress_bar(f"smallest box, {self.rule or 'dense'}", "try", progress, budget.effort)

    # -- placing -----------------------------------------------------------------------------------------------------

    def place(self) -> None:
        """The first box, by a baseline."""
        first = self.shape.sized(self.best.taken / TUNING.first_density)
        room, rule = box_of(self.shape, first), self.rule or "spectral"
        self.placement = Placement(self.bodies, room, self.settings.seed, rule, straight=True)
        voxel = self.placement.room.voxel
        if self.placement.coarse:  # they may leave nothing between them, and growing costs little
            self.placement.enter(box_of(self.shape, self.shape.sized(self.best.taken)))
            return self._place_in_growing_box(None)
        # what comes next moves all anyway; between edges that are hardly longer than an object others may be needed
        coarser = [TUNING.first_voxels_coarser * voxel] if self.rule is None and "shrinking" in self.turns.gains else []
        whole = [edge / np.ceil(edge / voxel) for edge in first[~self.shape.free]]
        for one in [*coarser, voxel, *whole]:
            try:
                self.placement.enter(room, voxel=one)
                return self._place_in_growing_box(None)
            except InputError as error:
                narrow = error
        raise narrow

    def place_again(self) -> None:
        """Place anew in a shaken order; the box starts a little below the best."""
        self.budget.tries += 1
        self.bar.update()
        edges = self.shape.sized(TUNING.replaced_volume_of_best * self.best.least)
        self.placement.enter(box_of(self.shape, edges))
        self._place_in_growing_box(self.placement.shaken())

    def _place_in_growing_box(self, order: np.ndarray | None) -> None:
        """Place all, the box growing by a voxel at a time; given up if it would be no smaller than the best, and, if
        there is a best, when time is over."""
        longest, edges = _longest(self.bodies), self.placement.container.base.size

        def late() -> bool:
            return self.best.container is not None and self.budget.spent()

        while True:
            self.placement.fill(order, late)
            if len(self.placement.placed) == len(self.bodies):
                break
            shortest = np.arange(3) == np.where(self.shape.free, edges, np.inf).argmin()
            edges = edges + self.placement.room.voxel * (self.shape.free if self.shape.cube else shortest)
            if np.prod(edges) >= self.best.least or late():
                return
            if edges[self.shape.free].min() > (longest + 2 * self.placement.room.voxel) * len(self.bodies):
                raise InputError(TOO_NARROW)
            self.placement.enter(box_of(self.shape, edges), keep=True)
        backwards = np.argsort(list(self.placement.placed))
        poses = self.placement.poses.take(backwards)
        kept = self.best.keep(poses, edges if self.shape.zones else None)
        if not kept and self.best.container is None and not self.best.hold(poses, edges):  # by a thousandth of a voxel
            raise InputError(TOO_NARROW)

    # -- the means by which it gets smaller --------------------------------------------------------------------------

    @cached_property
    def pressing(self) -> Pressing:
        return Pressing(self.best, self.settings.seed, lambda: self.budget.over(1 - TUNING.last_fraction_of_budget))

    @cached_property
    def shrinking(self) -> Shrinking:
        from .shrinking import Shrinking

        voxel = first_size(self.bodies, self.shape, self.best.taken, self.placement.cubes)
        return Shrinking(self.best, voxel, self.settings.seed, self.separable)

    def improve(self) -> None:
        """One try by the means whose turn it is."""
        self.budget.tries += 1
        self.bar.update()
        if self.least_before is None:
            self.least_before = self.best.least
            self.means.begin()
        self.means.improve(self.budget.spent)
        if self.turns.over(self.means.falling, self.means.seconds):
            self.means.end(self.budget.spent)
            changed = self.turns.next(np.log(self.least_before / self.best.least))
            self.least_before = self.best.least
            if changed:
                self.means.begin()

    @property
    def means(self) -> Shrinking | Pressing:
        """Whose turn it is."""
        return getattr(self, self.turns.now)

    # -- the record --------------------------------------------------------------------------------------------------

    @property
    def full(self) -> bool:
        """Nothing is left to gain, or the time that is left is too short."""
        return self.turns.left == 0 or self.best.least <= self.best.taken * (1 + TUNING.negligible_of_volume)

    def _note(self, edges: np.ndarray, density: float) -> None:
        self.rounds.append({"tries": self.budget.tries, "box": edges.tolist(), "density": density})
        self.bar.set_postfix_str(f"{' x '.join(f'{e:.4f}' for e in edges)} m, density {density:.4f}")

    def result(self) -> Packing:
        """The smallest box, certified anew."""
        return finish(
            self.bodies,
            list(range(len(self.bodies))),
            self.best.poses,
            self.best.container,
            self.settings,
            self.device,
            rounds=self.rounds,
            interrupted=self.interrupted,
        )


def largest_box(bodies: Sequence[Body], shape: FreeBox) -> Container:
    """A box of the shape in which bodies that fit into none such do not fit, see `pool.check_sizes`."""
    return shrunk(box(shape.lengths(_longest(bodies)) + 2 * shape.margin), shape.margin)


def _longest(bodies: Sequence[Body]) -> float:
    """A length in metres that no body exceeds, however it is turned."""
    return max((2 * body.radius for body in bodies), default=1.0)
