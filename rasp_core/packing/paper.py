"""The paper's method: random poses, Eq. 1, then objects dropped or added until N = N_max, judged by exact booleans.

The paper: N_init = |C| / mean |O| objects at random poses, Eq. 1, then objects are added or dropped until N = N_max,
the most that fit with no intersection. It departs from the text so:

- every round goes on from the poses of the round before instead of from new random ones;
- what is dropped is chosen: the objects that share the most volume with others, for their own volume (by booleans);
- what is added starts where, of random rotations and all positions, it shares the least volume with the others;
- lambda is 3 instead: with the paper's 0.001 the overlap term, a sum over points of depths in metres, outweighs the
  walls by far and pushes everything out of the box;
- a last stage has surface contact (`contact.contact`) alone, which sees overlaps thinner than the spacing of the
  query points; when objects are added, Eq. 5 acts beyond the walls only (`separation`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from .. import losses
from ..density import mesh_density
from ..exact.certificate import TOLERANCE, certify
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..geometry.sdf import GridStack
from ..optimizer import optimize
from ..poses import Poses
from ..problem import Problem, Settings
from ..util.budget import Budget
from ..util.errors import InputError
from ..util.progress import progress_bar
from .insertion import Voids
from .layout import Layout
from .pool import check_sizes
from .result import Packing, finish
from .separation import Separation


@dataclass(frozen=True)
class PaperTuning:
    """What the search about the paper's loop was tuned to."""

    first_round_of_iterations: float = 0.15  # the first and the settling rounds; those between take a quarter of it
    wall_weight: float = 3.0  # what the paper's lambda of 0.001 becomes while packing, per metre
    contact_margin_of_width: float = 3e-4  # of the viewing width
    resolvable_fault_fraction: float = 0.01  # of the objects' volume: what the last stage can press out
    most_dropped_fraction: float = 0.08  # of the objects, in one round
    refusals_until_full: int = 12  # objects in a row that could not be added, after which N_max is reached
    most_additions_tried: int = 50
    simplified_by_of_radius: float = 0.005  # how far surfaces may stray when booleans only choose what is dropped
    stalled_fraction: float = 0.7  # a settling round that leaves more than this of the worst fault has stalled


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
) -> Packing:
    """Pack objects into a container and certify the result.

    count None: start from `initial_count` objects of the pool in seeded order and drop objects until the certificate
    holds. A number: arrange exactly the first that many of that order, without search, and report what is.
    settings : learning rates, contact terms and, when searching, the weight of the walls are the search's own (see
    above); lambda_ scales the latter. A search makes about two to five times `settings.iterations` iterations.
    time_limit : seconds; then, or at Ctrl-C, the objects at fault are dropped as they lie.

    Raises InputError for no bodies, a count out of range, or bodies larger than the container.
    """
    settings = settings or Settings()
    check_sizes(bodies, container)
    if count is not None and not 1 <= count <= len(bodies):
        raise InputError(f"count must lie between 1 and the {len(bodies)} objects given, got {count}")
    order = np.random.default_rng(settings.seed).permutation(len(bodies))
    chosen = [int(i) for i in order[: count or initial_count(bodies, container)]]
    run = _Run(bodies, container, chosen, settings, device, time_limit, progress)
    with run.bar:
        return run.fixed() if count is not None else run.search()


class _Run:
    """One packing under way: the objects `chosen` at `poses`, and the last round's arrangement and certificate."""

    def __init__(
        self,
        pool: Sequence[Body],
        container: Container,
        chosen: list[int],
        settings: Settings,
        device: str | torch.device,
        time_limit: float | None,
        progress: bool,
    ):
        self.pool, self.container, self.chosen = pool, container, chosen
        self.settings, self.device = settings, device
        self.budget = Budget(time_limit)
        self.poses = Poses.random(self.bodies, container, settings.seed)
        self.rough: list[Body] = []  # the pool, simplified
        self.histories, self.rounds = [], []
        self.bar = progress_bar("pack", "it", progress)

    @property
    def bodies(self) -> list[Body]:
        return [self.pool[i] for i in self.chosen]

    def fixed(self) -> Packing:
        self._round(self.settings)
        return Packing(self.arrangement, self.certificate, self.chosen, self.arrangement.history, self.rounds)

    def search(self) -> Packing:
        length = max(1, round(TUNING.first_round_of_iterations * self.settings.iterations))
        base = replace(
            self.settings,
            iterations=length,
            lambda_=self.settings.lambda_ * TUNING.wall_weight / losses.LAMBDA,
            learning_rate=2e-2,
            final_learning_rate=3e-3,
        )
        self.rough = [_simplified(body) for body in self.pool]
        self._round(base, rough=True)
        relax = replace(base, iterations=max(1, length // 4), learning_rate=8e-3, final_learning_rate=2e-3)
        while len(self.chosen) > 1 and not self.stopped and self.fault_fraction > TUNING.resolvable_fault_fraction:
            self._drop(max(1, int(len(self.chosen) * min(TUNING.most_dropped_fraction, self.fault_fraction))))
            self._round(relax, rough=True)
        self._judge()
        settle = replace(
            base,
            learning_rate=3e-3,
            final_learning_rate=1e-4,
            silhouette_weight=0.0,
            overlap_weight=0.0,
            lambda_=0.0,
            contact_weight=1.0,
            contact_margin=TUNING.contact_margin_of_width * max(camera.width for camera in self.container.views()),
        )
        before = np.inf
        while self.chosen and not self.stopped and not self.certificate.holds:
            before, stalled = self.worst, self.worst > TUNING.stalled_fraction * before
            if stalled:
                self._drop(1)
            if self.chosen:
                self._round(settle)
        while self.chosen and not self.certificate.holds:  # stopped early: what is left must hold as it lies
            self._drop(1)
            if self.chosen:
                self._judge()
        self._add()
        interrupted = self.stopped or self.budget.spent()
        return finish(
            self.pool,
            self.chosen,
            self.poses,
            self.container,
            self.settings,
            self.device,
            history=self.histories,
            rounds=self.rounds,
            interrupted=interrupted,
        )

    def _add(self) -> None:
        """Objects one by one, each kept if the certificate then holds, until too many of them in a row could not
        be added, or enough were tried."""
        random, refused = np.random.default_rng(self.settings.seed), 0
        device, stack = self.device, GridStack.of_bodies(self.pool, self.device)
        voids = Voids(self.pool, self.container, device, random, stack)
        separation = Separation(self.pool, self.container, self.settings, device, self.budget.spent, stack)
        for attempt in range(TUNING.most_additions_tried):
            if len(self.chosen) == len(self.pool) or refused == TUNING.refusals_until_full or self.stopped:
                break
            refused += 1
            layout = voids.fill(Layout(self.chosen, self.poses), 1)
            if len(layout) == len(self.chosen):
                continue
            movers = voids.neighbours(layout, inserted=1)
            separated = separation.separate(layout, self.settings.seed + attempt, movers, patient=True)
            if separated is not None:
                self.chosen, self.poses, refused = separated.chosen, separated.poses, 0
                self._record(added=True)
        self.histories += separation.history

    @property
    def stopped(self) -> bool:
        return self.arrangement.interrupted

    @property
    def worst(self) -> float:
        return max(self.certificate.worst_overlap, self.certificate.worst_protrusion)

    @property
    def fault_fraction(self) -> float:
        faults = self.certificate.overlap_volume + self.certificate.protrusion_volume
        return faults / sum(body.volume for body in self.bodies)

    def _round(self, settings: Settings, rough: bool = False) -> None:
        problem = Problem(self.bodies, self.container)
        self.arrangement = optimize(problem, settings, self.poses, self.device, callback=self._after_step)
        self.poses = self.arrangement.poses
        self.histories.append(self.arrangement.history)
        self._judge(rough)

    def _after_step(self, _step) -> bool:
        self.bar.update()
        return self.budget.spent()

    def _judge(self, rough: bool = False) -> None:
        """rough : by simplified solids, to choose what is dropped; proves nothing."""
        bodies = [self.rough[i] for i in self.chosen] if rough else self.bodies
        self.certificate = certify(bodies, self.arrangement.matrices, self.container, TOLERANCE)
        self._record(added=False)

    def _record(self, added: bool) -> None:
        density, faults = mesh_density(self.bodies, self.container), 0.0 if added else self.fault_fraction
        self.rounds.append({"added": added, "objects": len(self.chosen), "density": density, "fault_share": faults})
        self.bar.set_postfix_str(f"objects {len(self.chosen)}, density {density:.4f}, overlap {faults:.1e}")

    def _drop(self, count: int) -> None:
        """Take out the `count` objects with the most volume at fault for their own volume."""
        at_fault = dict.fromkeys((body.name for body in self.bodies), 0.0)
        for overlap in self.certificate.overlaps:
            at_fault[overlap.first] += overlap.volume
            at_fault[overlap.second] += overlap.volume
        for protrusion in self.certificate.protrusions:
            at_fault[protrusion.body] += protrusion.volume
        fraction = np.array([at_fault[body.name] / body.volume for body in self.bodies])
        keep = sorted(np.argsort(-fraction, kind="stable")[count:].tolist())
        self.chosen = [self.chosen[i] for i in keep]
        self.poses = self.poses.take(keep)
        if not keep:  # what lay at random may yet fit where it is added
            return
        problem = replace(self.arrangement.problem, bodies=self.bodies)
        self.arrangement = replace(
            self.arrangement, problem=problem, rotation=self.poses.rotation, translation=self.poses.translation
        )


def _simplified(body: Body) -> Body:
    """The body with a surface of fewer triangles, which strays a little; `volume` is as it was."""
    mesh = body.manifold.simplify(TUNING.simplified_by_of_radius * body.radius).to_mesh64()
    return replace(body, solid_vertices=np.array(mesh.vert_properties)[:, :3], solid_faces=np.array(mesh.tri_verts))
