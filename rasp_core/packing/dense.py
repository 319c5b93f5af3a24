"""The kit's own packing: spectral placement, then objects pressed into what is left, by the same losses.

1. Spectral placement, ruined and built again for a fraction of the budget (`constructive`).
2. Objects tried one by one, alone or for smaller ones, and all pressed apart (`growth`).
3. Where there are copies, in turns with that: several objects more in a higher box, whose top is lowered (`lowering`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from ..exact.certificate import TOLERANCE, Certificate, certify
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..poses import file_to_world
from ..problem import Settings
from ..util.budget import Budget
from ..util.devices import resolve_device
from ..util.progress import progress_bar
from .constructive import FEW_VOXELS, Placement
from .growth import Growth
from .layout import Layout
from .lowering import Lowering, is_worth
from .pool import Worth
from .result import Packing, finish
from .separation import Separation
from .turns import Turns


@dataclass(frozen=True)
class DenseTuning:
    """What the dense search was tuned to."""

    tries: int = 400  # if neither time nor effort is given
    rebuild_fraction_of_time: float = 0.2


TUNING = DenseTuning()


def pack(
    bodies: Sequence[Body],
    container: Container,
    settings: Settings | None = None,
    device: str | torch.device = "cpu",
    time_limit: float | None = None,
    effort: int | None = None,
    progress: bool = False,
) -> Packing:
    """The densest certified packing of some of `bodies` that is found.

    bodies : one at least, of sizes that `pool.check_sizes` lets pass. time_limit : seconds. effort : number of tries,
    400 if neither is given; the same effort and seed give the same packing on a machine. settings : seed, resolution,
    query_points, jitter, overlap_term and rotation count. Ctrl-C and the time limit return the best so far.

    Raises InputError for a negative effort, or if not one could be placed.
    """
    settings = settings or Settings()
    budget = Budget(time_limit, TUNING.tries if effort is None and time_limit is None else effort)
    search = _Search(bodies, container, settings, device, budget, progress)
    try:
        search.construct()
        search.grow()
    except KeyboardInterrupt:
        if not len(search.layout):
            raise
        search.interrupted = True
    finally:
        search.bar.close()
    return search.result()


class _Search:
    """A search under way. layout : the best packing so far, which holds."""

    def __init__(
        self,
        pool: Sequence[Body],
        container: Container,
        settings: Settings,
        device: str | torch.device,
        budget: Budget,
        progress: bool,
    ):
        self.pool, self.container, self.settings = list(pool), container, settings
        self.device = resolve_device(device)
        self.budget = budget
        self.random = np.random.default_rng(settings.seed)
        self.worth = Worth(pool)
        self.layout = Layout.empty()
        self.history: list[np.ndarray] = []
        self.pulls: list[np.ndarray] = []
        self.rounds: list[dict] = []
        self.interrupted = False
        self.bar = progress_bar("dense", "try", progress, budget.effort)

    @property
    def density(self) -> float:
        return self.worth.volume(self.layout.chosen) / self.container.whole.volume

    # -- construction ------------------------------------------------------------------------------------------------

    def construct(self) -> None:
        """Spectral placement, and its rebuilding."""
        spectral = Placement(self.pool, self.container, self.settings.seed)
        spectral.fill(stop=self.budget.spent)
        self._take(spectral)
        self.cubes = spectral.cubes
        if not spectral.coarse:  # pressing in is worth more
            return
        fraction = TUNING.rebuild_fraction_of_time
        voxels, done = int(spectral.room.shape.prod()), 0
        rebuildings = np.inf if self.budget.effort is None else self.budget.effort * FEW_VOXELS // voxels
        while len(self.layout) and done < rebuildings and not self.budget.spent(fraction):
            spectral.rebuild(lambda: self.budget.spent(fraction))
            done += 1
            if self.worth.more(spectral.layout.chosen, self.layout.chosen):
                self._take(spectral)

    def _take(self, spectral: Placement) -> None:
        """Certify a placement, and keep what holds of it."""
        layout = spectral.layout
        while len(layout) and not (certificate := self._certify(layout)).holds:
            # voxels cover what touches them, so this is for what the voxeliser's rounding lets through
            names = [fault.first for fault in certificate.overlaps] + [p.body for p in certificate.protrusions]
            layout = layout.take([i for i, index in enumerate(layout.chosen) if self.pool[index].name != names[0]])
        if self.worth.more(layout.chosen, self.layout.chosen):
            self._keep(layout)

    # -- growth ------------------------------------------------------------------------------------------------------

    def grow(self) -> None:
        """Try objects until the budget is spent."""
        if len(self.layout) == len(self.pool):  # nothing is left to try, and grids of many objects take long
            return
        separation = Separation(self.pool, self.container, self.settings, self.device, self.budget.spent)
        self.history, self.pulls = separation.history, separation.pulls
        growth = Growth(self.pool, self.container, separation, self.random, self.settings.seed, self._keep)
        means = ["growth"]
        if is_worth(self.pool, self.container):
            lowering = Lowering(self.pool, self.container, self.cubes, self.random, self._keep)
            means.append("lowering")
        turns = Turns(means, self.budget)
        before = self.density
        while not self.budget.over() and len(self.layout) < len(self.pool):
            self.budget.tries += 1
            self.bar.update()
            if turns.now == "growth":
                growth.improve(self.layout, self.budget.tries)
            else:
                lowering.improve(self.layout, self.budget.spent)
            if turns.over():
                turns.next(self.density - before)
                before = self.density

    # -- the record --------------------------------------------------------------------------------------------------

    def _certify(self, layout: Layout) -> Certificate:
        bodies = layout.bodies(self.pool)
        matrices = file_to_world(bodies, layout.poses.rotation, layout.poses.translation)
        return certify(bodies, matrices, self.container, TOLERANCE)

    def _keep(self, layout: Layout) -> None:
        self.layout = layout
        self.rounds.append({"tries": self.budget.tries, "objects": len(layout), "density": self.density})
        self.bar.set_postfix_str(f"objects {len(layout)}, density {self.density:.4f}")

    def result(self) -> Packing:
        """The best packing, certified anew."""
        return finish(
            self.pool,
            self.layout.chosen,
            self.layout.poses,
            self.container,
            self.settings,
            self.device,
            history=self.history,
            pulls=self.pulls,
            rounds=self.rounds,
            interrupted=self.interrupted,
        )
