"""The paper's method: random poses, Eq. 1, then objects dropped or added until N = N_max, judged by exact booleans.

The paper: N_init = |C| / mean |O| objects at random poses, Eq. 1, then objects are added or dropped until N = N_max,
the most that fit with no intersection. Shadows guide from the first iteration to the last: silhouettes are summed as in
the authors' code (`problem.WEIGHTINGS`), and the viewing volume is wide enough to see what overlap throws out. It
departs from the text so:

- every round goes on from the poses of the round before instead of from new random ones;
- what is dropped is chosen: the objects that share the most volume with others, for their own volume (by booleans);
- from the second round on contact of surfaces (`kernels.surface_contact`) helps Eq. 4, as it sees overlaps thinner than
  the spacing of the query points; a last stage takes the rest away, under weaker shadows (`separation`);
- what is added starts where, of some rotations and all positions, it shares the least volume with the others, now and
  then for a smaller object that is taken out (`growth`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from ..density import mesh_density
from ..exact.certificate import TOLERANCE, Certificate, certify
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..optimizer import Arrangement, Step, optimize
from ..poses import Poses, file_to_world
from ..problem import Problem, Settings
from ..util.budget import Budget
from ..util.errors import InputError
from ..util.progress import progress_bar
from .growth import Growth
from .layout import Layout
from .pool import Worth
from .result import Packing, finish
from .separation import Separation


@dataclass(frozen=True)
class PaperTuning:
    """What the search about the paper's loop was tuned to."""

    first_round_of_iterations: float = 0.3
    next_rounds_of_first: float = 0.25
    contact_margin_of_width: float = 3e-4  # of the viewing width
    descending_fraction_of_time: float = 0.5  # at most, if time is limited
    resolvable_fault_fraction: float = 0.006  # of the objects' volume: what the last stage can press out
    most_dropped_fraction: float = 0.08  # of the objects, in one round
    dropped_over_fault_fraction: float = 2.0  # once contact has pressed
    tries_of_iterations: float = 0.15  # to add an object
    failures_until_full: int = 60  # in a row, after which N_max is reached
    simplified_by_of_radius: float = 0.005  # how far surfaces may stray when booleans only choose what is dropped


TUNING = PaperTuning()


def initial_count(bodies: Sequence[Body], container: Container) -> int:
    """The paper's `N_init = |C| / mean |O|`, at least 1 and at most all of them."""
    mean = float(np.mean([body.volume for body in bodies]))
    return int(np.clip(round(container.volume / mean), 1, len(bodies)))


def pack(
    bodies: Sequence[Body],
    container: Container,
    count: int | None = None,
    settings: Settings | None = None,
    device: str | torch.device = "cpu",
    time_limit: float | None = None,
    progress: bool = False,
    watch: Callable[[list[int], Poses, Tensor | None], object] | None = None,
) -> Packing:
    """Pack objects into a container and certify the result.

    bodies : one at least, of sizes that `pool.check_sizes` lets pass.
    count None: start from `initial_count` objects of the pool in seeded order and drop objects until the certificate
    holds, then add what fits. A number: arrange exactly the first that many of that order, without search, and report
    what is.
    settings : when searching, learning rates and contact terms are the search's own (see above). `iterations` set its
    length: about ten times as many are made.
    time_limit : seconds; then, or at Ctrl-C, the objects at fault are dropped as they lie.
    watch : told the objects' indices, their poses and, after an iteration, its losses, wherever they change.

    Raises InputError for a count out of range.
    """
    settings = settings or Settings()
    if count is not None and not 1 <= count <= len(bodies):
        raise InputError(f"count must lie between 1 and the {len(bodies)} objects given, got {count}")
    order = Worth(bodies).first(np.random.default_rng(settings.seed).permutation(len(bodies)))
    chosen = [int(i) for i in order[: count or initial_count(bodies, container)]]
    run = _Run(bodies, container, chosen, settings, device, time_limit, progress, watch)
    with run.bar:
        return run.fixed() if count is not None else run.search()


class _Run:
    """One packing under way: the objects and poses of `layout`, and the last certificate, which may be of simplified
    solids."""

    def __init__(
        self,
        pool: Sequence[Body],
        container: Container,
        chosen: list[int],
        settings: Settings,
        device: str | torch.device,
        time_limit: float | None,
        progress: bool,
        watch: Callable[[list[int], Poses, Tensor | None], object] | None,
    ):
        self.pool, self.container, self.settings, self.device = pool, container, settings, device
        self.budget, self.watch = Budget(time_limit), watch or (lambda chosen, poses, losses: None)
        self.part_of_time = 1.0  # after which what is under way ends
        self.layout = Layout(chosen, Poses.random([pool[i] for i in chosen], container, settings.seed))
        self.histories, self.pulls, self.rounds = [], [], []
        self.stray = 0.0  # of outlines, metres
        self.bar = progress_bar("pack", "it", progress)

    def fixed(self) -> Packing:
        """All objects arranged, without search."""
        run = self._round(self.settings)
        certificate = certify(run.bodies, run.matrices, self.container, TOLERANCE)
        return Packing(run, certificate, self.layout.chosen, run.history, self.rounds)

    def search(self) -> Packing:
        """Objects dropped and added until N = N_max."""
        separation = Separation(self.pool, self.container, self.settings, torch.device("cpu"), self.spent, shadows=True)
        self.stray, interrupted = separation.stray, False
        try:
            self.part_of_time = TUNING.descending_fraction_of_time
            self._descend()
            self.part_of_time = 1.0
            self._settle(separation)
            self._grow(separation)
        except KeyboardInterrupt:
            interrupted = True
        ended_early = interrupted or self.spent()
        while ended_early and len(self.layout) and not self._judge().holds:  # what is left must hold as it lies
            self._drop(0.0)
        return finish(
            self.pool,
            self.layout.chosen,
            self.layout.poses,
            self.container,
            self.settings,
            self.device,
            history=[*self.histories, *separation.history],
            pulls=[*self.pulls, *separation.pulls],
            rounds=self.rounds,
            interrupted=ended_early,
        )

    def _descend(self) -> None:
        """Eq. 1 and dropping, in turns, until what is at fault can be pressed out."""
        length = max(1, round(TUNING.first_round_of_iterations * self.settings.iterations))
        first = replace(self.settings, iterations=length, learning_rate=1e-2, final_learning_rate=1e-3)
        following = replace(
            first,
            iterations=max(1, round(TUNING.next_rounds_of_first * length)),
            learning_rate=4e-3,
            contact_weight=1.0,
        )
        rough = [body.simplified(TUNING.simplified_by_of_radius * body.radius) for body in self.pool]
        self._round(first)
        self._judge(rough)
        while self._share_at_fault > TUNING.resolvable_fault_fraction and len(self.layout) > 1 and not self.spent():
            self._drop(self._share_at_fault)
            self._round(following)
            self._judge(rough)

    def _settle(self, separation: Separation) -> None:
        """Press what is left apart, and drop, until the certificate holds."""
        attempt = self.settings.seed
        while len(self.layout) and not self.spent():
            self.layout = separation.press(self.layout, attempt).layout
            settled = separation.settle(self.layout, attempt)
            if settled is not None:
                self.layout = settled
                self._judge()
                return
            self._judge()
            self._drop(TUNING.dropped_over_fault_fraction * self._share_at_fault)
            attempt += 1

    def _grow(self, separation: Separation) -> None:
        """Objects one by one, each kept if the certificate then holds, until too many tries in a row fail."""
        random, failures = np.random.default_rng(self.settings.seed), 0
        growth = Growth(self.pool, self.container, separation, random, self.settings.seed, self._added)
        for number in range(round(TUNING.tries_of_iterations * self.settings.iterations)):
            if len(self.layout) == len(self.pool) or failures == TUNING.failures_until_full or self.spent():
                return
            before = self.layout
            self.layout = growth.improve(before, number)
            failures = failures + 1 if self.layout is before else 0
            self.bar.update()

    def spent(self) -> bool:
        """True where the time is over that what is under way has."""
        return self.budget.spent(self.part_of_time)

    def _added(self, layout: Layout) -> None:
        self.layout = layout
        self._record(added=True, at_fault=0.0)

    def _round(self, settings: Settings) -> Arrangement:
        problem = Problem(self.layout.bodies(self.pool), self.container)
        # a GPU is quick where nothing has to be looked up between iterations, as what may come into contact has
        device = "cpu" if settings.contact_weight else self.device
        scene = problem.scene(device, viewing_volume=settings.viewing_volume, stray=self.stray)
        run = optimize(problem, settings, self.layout.poses, device, scene=scene, callback=self._after_step)
        self.layout = Layout(self.layout.chosen, run.poses)
        self.histories.append(run.history)
        self.pulls.append(run.pulls)
        if run.interrupted and not self.spent():
            raise KeyboardInterrupt
        return run

    def _after_step(self, step: Step) -> bool:
        self.watch(self.layout.chosen, Poses(step.rotation, step.translation), step.losses)
        self.bar.update()
        return self.spent()

    def _judge(self, solids: Sequence[Body] | None = None) -> Certificate:
        """The certificate of the layout; by `solids`, simplified ones of the pool, to choose what is dropped: that
        proves nothing."""
        bodies, poses = self.layout.bodies(solids or self.pool), self.layout.poses
        matrices = file_to_world(bodies, poses.rotation, poses.translation)
        self.certificate = certify(bodies, matrices, self.container, TOLERANCE)
        self._record(added=False, at_fault=self._share_at_fault)
        return self.certificate

    @property
    def _share_at_fault(self) -> float:
        return self.certificate.fault_volume / sum(body.volume for body in self.layout.bodies(self.pool))

    def _record(self, added: bool, at_fault: float) -> None:
        self.watch(self.layout.chosen, self.layout.poses, None)
        count, density = len(self.layout), mesh_density(self.layout.bodies(self.pool), self.container.whole)
        self.rounds.append({"added": added, "objects": count, "density": density, "fault_share": at_fault})
        self.bar.set_postfix_str(f"objects {count}, density {density:.4f}, overlap {at_fault:.1e}")

    def _drop(self, share: float) -> None:
        """Take out this share of the objects, but one at least and not too many at once: those with the most volume at
        fault for their own volume."""
        count = max(1, int(len(self.layout) * min(TUNING.most_dropped_fraction, share)))
        bodies = self.layout.bodies(self.pool)
        at_fault = dict.fromkeys((body.name for body in bodies), 0.0)
        for overlap in self.certificate.overlaps:
            at_fault[overlap.first] += overlap.volume
            at_fault[overlap.second] += overlap.volume
        for protrusion in self.certificate.protrusions:
            at_fault[protrusion.body] += protrusion.volume
        fraction = np.array([at_fault[body.name] / body.volume for body in bodies])
        rank = Worth(self.pool).rank[self.layout.chosen]
        rank = np.where(fraction > 0, rank, rank.max() + 1)  # of those at fault the least ranks first
        self.layout = self.layout.take(sorted(np.lexsort((-fraction, rank))[count:].tolist()))
