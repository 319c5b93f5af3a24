"""Packing: as many objects as fit in a container without intersection, by the paper's losses.

The paper: N_init = |C| / mean |O| objects at random poses, Eq. 1, then objects are added or dropped until N = N_max,
the most that fit with no intersection. Here: from N_init downwards, in one warm run. It departs from the text so:

- every round goes on from the poses of the round before instead of from new random ones;
- what is dropped is chosen: the objects that share the most volume with others, for their own volume (by booleans);
- lambda is WALL_WEIGHT: with the paper's 0.001 the overlap term, a sum over points of depths in metres, outweighs the
  walls by far and pushes everything out of the box;
- a last stage has surface contact (`contact.contact`) alone, which sees overlaps thinner than the spacing of the
  query points.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from tqdm.auto import tqdm

from . import losses
from .arrange import LOSS_NAMES, Arrangement, arrange, draw_images
from .certify import TOLERANCE, Certificate, certify
from .containers import Container
from .density import mesh_density
from .errors import InputError
from .meshes import Body, unique_names
from .problem import Problem, Settings, Start
from .sdf import bake_cached
from .silhouettes import render

FIRST_ROUND = 0.15  # of `iterations`: the length of the first and the settling rounds; those between take a quarter
WALL_WEIGHT = 3.0  # what the paper's lambda of 0.001 becomes while packing
CLEARANCE = 3e-4  # contact margin, in viewing widths
RESOLVABLE = 0.01  # share of overlapping volume that the last stage can press out
LARGEST_DROP = 0.08  # share of the objects dropped in one round
STALLED = 0.7  # a settling round that leaves more than this of the worst fault has stalled


@dataclass(frozen=True)
class Packing:
    """A packing of some of a pool's objects.

    chosen : indices into the pool, in the order of `arrangement.problem.bodies`.
    history : `(I, 5)` losses of every iteration of every round, columns `arrange.LOSS_NAMES`.
    rounds : what each round left, for the record.
    """

    arrangement: Arrangement
    chosen: list[int]
    certificate: Certificate
    history: np.ndarray
    rounds: list[dict]

    @property
    def density(self) -> float:
        """Eq. 6: the objects' volume over the container's."""
        return mesh_density(self.arrangement.problem.bodies, self.arrangement.problem.container)


def initial_count(bodies: Sequence[Body], container: Container) -> int:
    """The paper's `N_init = |C| / mean |O|`, at least 1 and at most all of them."""
    mean = float(np.mean([body.volume for body in bodies]))
    return int(np.clip(round(container.volume / mean), 1, len(bodies)))


def draw(bodies: Sequence[Body], count: int, seed: int) -> list[Body]:
    """`count` bodies drawn with replacement; copies are named `<name>#2`, ... Raises InputError for count < 1."""
    if count < 1:
        raise InputError(f"at least one object must be drawn, got {count}")
    chosen = np.random.default_rng(seed).integers(0, len(bodies), count)
    return unique_names([bodies[i] for i in chosen])


def fit_scale(bodies: Sequence[Body], container: Container, count: int) -> float:
    """The factor on lengths with which `count` mean objects make half of the container's volume."""
    if count < 1:
        raise InputError(f"objects can be fitted to one or more, got {count}")
    return float((0.5 * container.volume / count / np.mean([body.volume for body in bodies])) ** (1 / 3))


def progress_bar(name: str, unit: str, shown: bool, total: int | None = None) -> tqdm:
    """A search's bar on standard error, with few lines where that is a log file."""
    interval = 0.2 if sys.stderr.isatty() else 10
    return tqdm(desc=name, unit=unit, disable=not shown, leave=False, mininterval=interval, total=total)


def check_sizes(bodies: Sequence[Body], container: Container) -> None:
    """Raise InputError for no bodies, or naming the first that is too large for the container however it is turned.

    A body that fits has no more volume, no larger diameter and no larger inscribed ball than the container.
    """
    if not bodies:
        raise InputError("there is nothing to pack; give at least one object")
    diameter, ball = _diameter(container.body), _inscribed_radius(container.body)
    known: set[str] = set()
    for body in bodies:
        if body.digest in known:
            continue
        known.add(body.digest)
        if (
            body.volume > container.volume
            or (2 * body.radius > diameter and _diameter(body) > diameter)
            or (body.half_extents.min() > ball and _inscribed_radius(body) > ball)
        ):
            size = " x ".join(f"{2 * h:.3g}" for h in body.half_extents)
            room = " x ".join(f"{edge:.3g}" for edge in np.ptp(container.bounds, axis=0))
            raise InputError(
                f"{body.name}: {size} m is larger than the container, {room} m; leave it out, enlarge the "
                "container, or scale the objects with --fit-objects"
            )


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
    """One packing under way."""

    def __init__(self, pool, container, chosen, settings, device, time_limit, progress):
        self.pool, self.container, self.chosen = pool, container, chosen
        self.settings, self.device = settings, device
        self.deadline = None if time_limit is None else time.monotonic() + time_limit
        self.start = Start.random(self.bodies, container, settings.seed)
        self.histories, self.rounds = [], []
        self.bar = progress_bar("pack", "it", progress)

    @property
    def bodies(self) -> list[Body]:
        return [self.pool[i] for i in self.chosen]

    def fixed(self) -> Packing:
        self._round(self.settings)
        return self._result()

    def search(self) -> Packing:
        length = max(1, round(FIRST_ROUND * self.settings.iterations))
        base = replace(
            self.settings,
            iterations=length,
            lambda_=self.settings.lambda_ * WALL_WEIGHT / losses.LAMBDA,
            learning_rate=2e-2,
            final_learning_rate=3e-3,
        )
        self._round(base)
        relax = replace(base, iterations=max(1, length // 4), learning_rate=8e-3, final_learning_rate=2e-3)
        while not self.stopped and self.fault_share > RESOLVABLE:
            self._drop(max(1, int(len(self.chosen) * min(LARGEST_DROP, self.fault_share))))
            self._round(relax)
        settle = replace(
            base,
            learning_rate=3e-3,
            final_learning_rate=1e-4,
            silhouette_weight=0.0,
            overlap_weight=0.0,
            lambda_=0.0,
            contact_weight=1.0,
            contact_margin=CLEARANCE * max(camera.width for camera in self.container.views()),
        )
        before = np.inf
        while not self.stopped and not self.certificate.holds:
            if self.worst > STALLED * before:
                self._drop(1)
            before = self.worst
            self._round(settle)
        while not self.certificate.holds:  # stopped early: what is left must hold as it lies
            self._drop(1)
            self._judge()
        return self._result()

    @property
    def stopped(self) -> bool:
        return self.arrangement.interrupted

    @property
    def worst(self) -> float:
        return max(self.certificate.worst_overlap, self.certificate.worst_protrusion)

    @property
    def fault_share(self) -> float:
        faults = self.certificate.overlap_volume + self.certificate.protrusion_volume
        return faults / sum(body.volume for body in self.bodies)

    def _round(self, settings: Settings) -> None:
        problem = Problem(self.bodies, self.container)
        self.arrangement = arrange(problem, settings, self.start, self.device, callback=self._after_step)
        self.start, self.dropped_last = self.arrangement.start, False
        self.histories.append(self.arrangement.history)
        self._judge()
        self.bar.set_postfix_str(
            f"objects {len(self.chosen)}, density {mesh_density(self.bodies, self.container):.4f}, "
            f"overlap {self.fault_share:.1e}"
        )

    def _after_step(self, _step) -> bool:
        self.bar.update()
        return self.deadline is not None and time.monotonic() > self.deadline

    def _judge(self) -> None:
        self.certificate = certify(self.bodies, self.arrangement.matrices, self.container, TOLERANCE)
        self.rounds.append(
            {
                "objects": len(self.chosen),
                "density": mesh_density(self.bodies, self.container),
                "fault_share": self.fault_share,
                "worst_overlap": self.certificate.worst_overlap,
                "worst_protrusion": self.certificate.worst_protrusion,
            }
        )

    def _drop(self, count: int) -> None:
        """Take out the `count` objects with the most volume at fault for their own volume."""
        if len(self.chosen) <= count:
            raise InputError("not one of the objects could be placed in the container; enlarge it or leave some out")
        at_fault = dict.fromkeys((body.name for body in self.bodies), 0.0)
        for overlap in self.certificate.overlaps:
            at_fault[overlap.first] += overlap.volume
            at_fault[overlap.second] += overlap.volume
        for protrusion in self.certificate.protrusions:
            at_fault[protrusion.body] += protrusion.volume
        share = np.array([at_fault[body.name] / body.volume for body in self.bodies])
        keep = sorted(np.argsort(-share, kind="stable")[count:].tolist())
        self.chosen = [self.chosen[i] for i in keep]
        self.start = self.start.take(keep)
        problem = replace(self.arrangement.problem, bodies=self.bodies)
        self.arrangement = replace(self.arrangement, problem=problem, **vars(self.start))
        self.dropped_last = True

    def _result(self) -> Packing:
        if self.dropped_last:
            self.arrangement = draw_images(self.arrangement, self.device)
        history = np.concatenate(self.histories)
        return Packing(self.arrangement, self.chosen, self.certificate, history, self.rounds)


def finish(
    bodies: Sequence[Body],
    chosen: list[int],
    start: Start,
    container: Container,
    settings: Settings,
    device: str | torch.device = "cpu",
    history: Sequence[np.ndarray] = (),
    rounds: Sequence[dict] = (),
    interrupted: bool = False,
) -> Packing:
    """The packing of the objects `chosen` from `bodies` at the poses `start`, drawn and certified.

    Raises InputError where nothing was chosen.
    """
    if not chosen:
        raise InputError("not one of the objects could be placed in the container; enlarge it or leave some out")
    problem = Problem([bodies[i] for i in chosen], container)
    scene = problem.scene(device)
    place = (x.to(scene.device, scene.dtype) for x in (start.rotation, start.translation))
    images = render(scene.outlines, *place, scene.views, settings.resolution).cpu().numpy()
    targets = scene.container_silhouettes(settings.resolution).cpu().numpy()
    past = np.concatenate([np.zeros((0, len(LOSS_NAMES)), np.float32), *history])
    poses = start.rotation.double().cpu(), start.translation.double().cpu()
    arrangement = Arrangement(problem, settings, *poses, images, targets, scene.cameras, past, interrupted)
    certificate = certify(problem.bodies, arrangement.matrices, container, TOLERANCE)
    return Packing(arrangement, list(chosen), certificate, past, list(rounds))


def _diameter(body: Body) -> float:
    """Largest distance between two points of the body."""
    corners = np.asarray(body.manifold.hull().to_mesh64().vert_properties)[:, :3]
    return max(float(np.linalg.norm(corners - corner, axis=1).max()) for corner in corners)


def _inscribed_radius(body: Body) -> float:
    """Radius of a ball that surely lies in the body (the deepest point of its grid)."""
    return float(-bake_cached(body).values.min())
