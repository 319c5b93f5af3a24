"""The kit's own packing: spectral placement, then objects pressed into what is left, by the same losses.

1. Spectral placement, ruined and built again for a fraction of the budget (`constructive`).
2. Again and again: an object of the pool goes where it overlaps least, alone or for a smaller one that is taken out
   (`insertion`), and all are pressed apart (`separation`). What holds and is denser is kept, everything else forgotten,
   so that there is a certified packing at any time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from ..exact.certificate import TOLERANCE, Certificate, certify
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..geometry.sdf import GridStack
from ..poses import file_to_world
from ..problem import Settings
from ..util.budget import Budget
from ..util.devices import resolve_device
from ..util.progress import progress_bar
from .constructive import FEW_VOXELS, Placement
from .insertion import Voids
from .layout import Layout
from .pool import check_sizes
from .result import Packing, finish
from .separation import Separation


@dataclass(frozen=True)
class DenseTuning:
    """What the dense search was tuned to."""

    tries: int = 400  # if neither time nor effort is given
    rebuild_fraction_of_time: float = 0.2
    moves_per_try: int = 24  # of which the most promising is tried
    swap_fraction_of_moves: float = 0.7  # in which an object is taken out for a larger one
    most_inserted_at_once: int = 16  # twice as many after each success, half after each failure
    # of a mean object's volume: what is shared by so much is pressed apart e times less often
    least_yielding_of_mean_volume: float = 1e-4
    most_yielding_of_mean_volume: float = 0.02
    yielding_after_success: float = 1.3  # times what it was
    yielding_after_failure: float = 0.8


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

    time_limit : seconds. effort : number of tries, 400 if neither is given; the same effort and seed give the same
    packing on a machine. settings : seed, resolution, query_points, jitter, overlap_term and rotation count. Ctrl-C and
    the time limit return the best so far.

    Raises InputError for no bodies, a negative effort, bodies larger than the container, or if not one could be placed.
    """
    settings = settings or Settings()
    check_sizes(bodies, container)
    budget = Budget(time_limit, TUNING.tries if effort is None and time_limit is None else effort)
    search = _Search(bodies, container, settings, device, budget, progress)
    try:
        search.construct()
        search.insert()
    except KeyboardInterrupt:
        if not len(search.layout):
            raise
        search.interrupted = True
    finally:
        search.bar.close()
    return search.result()


class _Search:
    """A search under way. layout : the best packing so far, which holds. volumes : of the container's volume."""

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
        self.volumes = np.array([body.volume for body in pool]) / container.volume
        self.layout = Layout.empty()
        self.history: list[np.ndarray] = []
        self.rounds: list[dict] = []
        self.inserted_at_once, self.yielding = 1, TUNING.most_yielding_of_mean_volume
        self.interrupted = False
        self.bar = progress_bar("dense", "try", progress, budget.effort)

    @property
    def density(self) -> float:
        return self._density(self.layout)

    def _density(self, layout: Layout) -> float:
        return float(self.volumes[layout.chosen].sum())

    # -- construction ------------------------------------------------------------------------------------------------

    def construct(self) -> None:
        """Spectral placement, and its rebuilding."""
        spectral = Placement(self.pool, self.container, self.settings.seed)
        spectral.fill(stop=self.budget.spent)
        self._take(spectral)
        if not spectral.coarse:  # pressing in is worth more
            return
        fraction = TUNING.rebuild_fraction_of_time
        voxels, done = int(spectral.room.shape.prod()), 0
        rebuildings = np.inf if self.budget.effort is None else self.budget.effort * FEW_VOXELS // voxels
        while len(self.layout) and done < rebuildings and not self.budget.spent(fraction):
            spectral.rebuild(lambda: self.budget.spent(fraction))
            done += 1
            if spectral.density > self.density + 1e-9:
                self._take(spectral)

    def _take(self, spectral: Placement) -> None:
        """Certify a placement, and keep what holds of it."""
        layout = spectral.layout
        while len(layout) and not (certificate := self._certify(layout)).holds:
            # voxels cover what touches them, so this is for what the voxeliser's rounding lets through
            names = [fault.first for fault in certificate.overlaps] + [p.body for p in certificate.protrusions]
            layout = layout.take([i for i, index in enumerate(layout.chosen) if self.pool[index].name != names[0]])
        if self._density(layout) > self.density:
            self._keep(layout)

    # -- insertion ---------------------------------------------------------------------------------------------------

    def insert(self) -> None:
        """Try objects until the budget is spent."""
        stack = GridStack.of_bodies(self.pool, self.device)
        voids = Voids(self.pool, self.container, self.device, self.random, stack)
        separation = Separation(self.pool, self.container, self.settings, self.device, self.budget.spent, stack)
        self.history = separation.history
        while not self.budget.over():
            if len(self.layout) == len(self.pool):
                return
            self.budget.tries += 1
            self.bar.update()
            proposal = self._propose(voids) if self.inserted_at_once == 1 else self._propose_many(voids)
            separated = None if proposal is None else self._separate(voids, separation, proposal)
            before = len(self.layout)
            if separated is not None and self._density(separated) > self.density - 1e-9:
                self._keep(separated)
            self._learn(succeeded=separated is not None, grown=len(self.layout) > before)

    def _learn(self, succeeded: bool, grown: bool) -> None:
        """What to try next, after a try that came to hold or did not, and that left more objects in or did not."""
        factor = TUNING.yielding_after_success if succeeded else TUNING.yielding_after_failure
        least, most = TUNING.least_yielding_of_mean_volume, TUNING.most_yielding_of_mean_volume
        self.yielding = float(np.clip(self.yielding * factor, least, most))
        once = self.inserted_at_once
        self.inserted_at_once = min(2 * once, TUNING.most_inserted_at_once) if grown else max(1, once // 2)

    def _propose(self, voids: Voids) -> Layout | None:
        """The most promising of some moves: what it gains, times the chance that what it shares with the others where
        it is put can be pressed out."""
        found, best = None, -np.inf
        mean, occupancy = self.volumes.mean(), voids.occupancy(self.layout)
        for _ in range(TUNING.moves_per_try):
            out, index = self._move()
            if index is None:
                continue
            insertion = voids.least_shared(voids.occupancy_without(occupancy, out), [index], voids.most_shared)
            if insertion is None:
                continue
            gain = self.volumes[index] - (0 if out is None else self.volumes[self.layout.chosen[out]])
            promise = np.log(gain) - insertion.shared / self.container.volume / (self.yielding * mean)
            if promise > best:
                found, best = self.layout.without(out).added(index, insertion.pose), promise
        return found

    def _propose_many(self, voids: Voids) -> Layout | None:
        """Several objects more, while there are voids for them."""
        layout = voids.fill(self.layout, self.inserted_at_once)
        return layout if len(layout) > len(self.layout) else None

    def _move(self) -> tuple[int | None, int | None]:
        """The position in `layout` of an object that is taken out, None for none, and the index of one that may come,
        larger; None for none."""
        out, least, chosen = None, 0.0, self.layout.chosen
        if chosen and self.random.random() < TUNING.swap_fraction_of_moves:
            out = int(self.random.integers(len(chosen)))
            least = self.volumes[chosen[out]]
        rest = np.setdiff1d(np.arange(len(self.pool)), chosen)
        rest = rest[(self.volumes[rest] > least * (1 + 1e-6)) & (self.volumes[rest] < least + 2 * self.volumes.mean())]
        return out, int(self.random.choice(rest)) if len(rest) else None

    def _separate(self, voids: Voids, separation: Separation, layout: Layout) -> Layout | None:
        """Press the objects apart until the certificate holds; None if it does not come to that."""
        movers = voids.neighbours(layout, inserted=max(1, len(layout) - len(self.layout)))
        return separation.separate(layout, self.settings.seed + self.budget.tries, movers)

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
            rounds=self.rounds,
            interrupted=self.interrupted,
        )
