"""What all packing methods share: the packing itself, pools drawn and scaled, what cannot fit, and how to end."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from tqdm.auto import tqdm

from ..density import mesh_density
from ..exact.certificate import TOLERANCE, Certificate, certify
from ..geometry.containers import Container
from ..geometry.meshes import Body, unique_names
from ..geometry.sdf import bake_cached
from ..objective import LOSS_NAMES
from ..optimizer import Arrangement
from ..poses import Poses
from ..problem import Problem, Settings
from ..silhouettes import render
from ..util.errors import InputError

MAX_DRAWS = 100_000


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


def draw(bodies: Sequence[Body], count: int, seed: int) -> list[Body]:
    """`count` bodies drawn with replacement; copies are named `<name>#2`, ...

    Raises InputError for a count below 1 or above `MAX_DRAWS`.
    """
    if not 1 <= count <= MAX_DRAWS:
        raise InputError(f"1 to {MAX_DRAWS:,} objects can be drawn, got {count}")
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


def finish(
    bodies: Sequence[Body],
    chosen: list[int],
    start: Poses,
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
