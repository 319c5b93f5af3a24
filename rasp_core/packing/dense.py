"""The kit's own packing: spectral placement, then objects pressed into what is left, by the same losses.

1. Spectral placement, ruined and built again for a share of the budget (`baselines`).
2. Again and again: an object of the pool goes where it overlaps least, alone or for a smaller one that is taken out,
   and all are pressed apart (`pressing`). What holds and is denser is kept, everything else forgotten, so that there
   is a certified packing at any time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch

from ..exact.certificate import TOLERANCE, Certificate, certify
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..poses import Poses, file_to_world, join
from ..problem import Settings
from ..util.budget import Budget
from ..util.devices import resolve_device
from .constructive import FEW_VOXELS, Placement
from .result import Packing, check_sizes, finish, progress_bar
from .separation import Press

EFFORT = 400  # tries, where no time is given
REBUILD_SHARE = 0.2  # of the seconds
MOVES = 24  # looked at in each try
YIELDING = 1e-4, 0.02  # of a mean object's volume, at least and at most: shared, it is pressed out e times less often
YIELDS, RESISTS = 1.3, 0.8  # what that is multiplied by after a try that came off, and one that did not
BATCH = 16  # objects put in at once, at most: twice as many after each success, half after each failure
SWAPS = 0.7  # share of the moves that take an object out for a larger one


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

    time_limit : seconds. effort : number of tries, `EFFORT` where neither is given; the same effort and seed give the
    same packing on a machine. settings : seed, resolution and query points count. Ctrl-C and the time limit return the
    best so far. Raises InputError for no bodies, bodies larger than the container, or where not one could be placed.
    """
    settings = settings or Settings()
    check_sizes(bodies, container)
    budget = Budget(time_limit, EFFORT if effort is None and time_limit is None else effort)
    search = _Search(bodies, container, settings, device, budget, progress)
    try:
        search.construct()
        search.press_in()
    except KeyboardInterrupt:
        if not search.chosen:
            raise
        search.interrupted = True
    finally:
        search.bar.close()
    return search.result()


class _Search:
    """A search under way: the packing that holds, as indices into the pool and poses."""

    def __init__(self, pool, container, settings, device, budget, progress):
        self.pool, self.container, self.settings = list(pool), container, settings
        self.device = resolve_device(device)
        self.budget = budget
        self.random = np.random.default_rng(settings.seed)
        self.volumes = np.array([body.volume for body in pool]) / container.volume
        self.chosen: list[int] = []
        self.start = Poses(torch.zeros(0, 3, 3), torch.zeros(0, 3))
        self.press: Press | None = None
        self.rounds: list[dict] = []
        self.batch, self.yielding, self.interrupted = 1, YIELDING[1], False
        self.bar = progress_bar("dense", "try", progress, budget.effort)

    @property
    def density(self) -> float:
        return float(self.volumes[self.chosen].sum())

    # -- construction ------------------------------------------------------------------------------------------------

    def construct(self) -> None:
        """Spectral placement, and its rebuilding."""
        spectral = Placement(self.pool, self.container, self.settings.seed)
        spectral.fill(stop=self.budget.spent)
        self._take(spectral)
        if not spectral.coarse:  # pressing in is worth more
            return
        voxels, done = int(spectral.room.shape.prod()), 0
        rebuildings = np.inf if self.budget.effort is None else self.budget.effort * FEW_VOXELS // voxels
        while self.chosen and done < rebuildings and not self.budget.spent(REBUILD_SHARE):
            spectral.rebuild(lambda: self.budget.spent(REBUILD_SHARE))
            done += 1
            if spectral.density > self.density + 1e-9:
                self._take(spectral)

    def _take(self, spectral: Placement) -> None:
        """Judge a placement, and keep what holds of it."""
        chosen, start = list(spectral.placed), spectral.start
        while chosen and not (certificate := self._judge(chosen, start)).holds:
            # voxels cover what touches them, so this is for what the voxeliser's rounding lets through
            names = [fault.first for fault in certificate.overlaps] + [p.body for p in certificate.protrusions]
            keep = [i for i, index in enumerate(chosen) if self.pool[index].name != names[0]]
            chosen, start = [chosen[i] for i in keep], start.take(keep)
        if self.volumes[chosen].sum() > self.density:
            self._keep(chosen, start)

    # -- pressing in -------------------------------------------------------------------------------------------------

    def press_in(self) -> None:
        """Try objects until the budget is spent."""
        self.press = Press(self.pool, self.container, self.settings, self.device, self.random, self.budget.spent)
        while not self.budget.over():
            if len(self.chosen) == len(self.pool):
                return
            self.budget.tries += 1
            self.bar.update()
            proposal = self._propose() if self.batch == 1 else self._propose_many()
            settled = None if proposal is None else self._settle(*proposal)
            self.yielding = float(np.clip(self.yielding * (RESISTS if settled is None else YIELDS), *YIELDING))
            before = len(self.chosen)
            if settled is not None and self.volumes[settled[0]].sum() > self.density - 1e-9:
                self._keep(*settled)
            self.batch = min(2 * self.batch, BATCH) if len(self.chosen) > before else max(1, self.batch // 2)

    def _propose(self) -> tuple[list[int], Poses] | None:
        """The most promising of some moves: what it gains, times the chance that what it shares with the others where
        it is put can be pressed out."""
        found, best = None, -np.inf
        mean = self.volumes.mean()
        for _ in range(MOVES):
            out, index = self._move()
            if index is None:
                continue
            self.press.look(self.chosen, self.start, out)
            place = self.press.least_shared([index], self.press.shareable)
            if place is None:
                continue
            index, pose, shared = place
            gain = self.volumes[index] - (0 if out is None else self.volumes[self.chosen[out]])
            promise = np.log(gain) - shared / self.container.volume / (self.yielding * mean)
            if promise > best:
                keep, best = [i for i in range(len(self.chosen)) if i != out], promise
                found = [*(self.chosen[i] for i in keep), index], join(self.start.take(keep), pose)
        return found

    def _propose_many(self) -> tuple[list[int], Poses] | None:
        """Several objects more, while there are voids for them."""
        chosen, start = self.press.add(self.chosen, self.start, self.batch, self.press.shareable)
        return (chosen, start) if len(chosen) > len(self.chosen) else None

    def _move(self) -> tuple[int | None, int | None]:
        """The place of an object that is taken out, None for none, and one that may come, larger; None for none."""
        out, least = None, 0.0
        if self.chosen and self.random.random() < SWAPS:
            out = int(self.random.integers(len(self.chosen)))
            least = self.volumes[self.chosen[out]]
        rest = np.setdiff1d(np.arange(len(self.pool)), self.chosen)
        rest = rest[(self.volumes[rest] > least * (1 + 1e-6)) & (self.volumes[rest] < least + 2 * self.volumes.mean())]
        return out, int(self.random.choice(rest)) if len(rest) else None

    def _settle(self, chosen: list[int], start: Poses) -> tuple[list[int], Poses] | None:
        """Press the objects apart until the certificate holds; None where it does not come to that."""
        fresh = max(1, len(chosen) - len(self.chosen))
        settled = self.press.press_in(chosen, start, self.settings.seed + self.budget.tries, fresh)
        return None if settled is None else (chosen, settled)

    # -- the record --------------------------------------------------------------------------------------------------

    def _judge(self, chosen: list[int], start: Poses) -> Certificate:
        bodies = [self.pool[index] for index in chosen]
        return certify(bodies, file_to_world(bodies, start.rotation, start.translation), self.container, TOLERANCE)

    def _keep(self, chosen: list[int], start: Poses) -> None:
        self.chosen, self.start = chosen, start
        self.rounds.append({"tries": self.budget.tries, "objects": len(chosen), "density": self.density})
        self.bar.set_postfix_str(f"objects {len(chosen)}, density {self.density:.4f}")

    def result(self) -> Packing:
        """The best packing, certified anew."""
        record = self.press.history if self.press else (), self.rounds, self.interrupted
        return finish(self.pool, self.chosen, self.start, self.container, self.settings, self.device, *record)
