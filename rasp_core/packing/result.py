"""What every packing method returns, and how it ends: drawn, and certified anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from ..exact.certificate import TOLERANCE, certify
from ..exact.certified import Certified
from ..exact.pulls import Dismantling
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..objective import LOSS_NAMES
from ..optimizer import Arrangement
from ..poses import Poses
from ..problem import Problem, Settings
from ..silhouettes import render
from ..util.errors import InputError
from .clearance import Clearance


@dataclass(frozen=True)
class Packing(Certified):
    """A packing of some of a pool's objects.

    chosen : indices into the pool, in the order of `bodies`.
    history : `(I, 5)` losses of every iteration of every round, columns `objective.LOSS_NAMES`.
    rounds : what each round left, for the record. dismantling : how it comes apart, where that was asked for.
    """

    chosen: list[int]
    history: np.ndarray
    rounds: list[dict]
    dismantling: Dismantling | None = None


def finish(
    bodies: Sequence[Body],
    chosen: list[int],
    poses: Poses,
    container: Container,
    settings: Settings,
    device: str | torch.device = "cpu",
    history: Sequence[np.ndarray] = (),
    rounds: Sequence[dict] = (),
    pulls: Sequence[np.ndarray] = (),
    interrupted: bool = False,
    clearance: tuple[np.ndarray, float] | None = None,
) -> Packing:
    """The packing of the objects `chosen` from `bodies` at `poses` in their order, drawn and certified.

    settings : for the record; the resolution is that of the images. history, pulls : `(I, 5)` and `(J, 4)` of each
    round, as in `optimizer.Arrangement`. clearance : what is asked for each of them, `(N,)` metres, and from the wall,
    as `gaps.measure` has it.

    Raises InputError if nothing was chosen.
    """
    if not chosen:
        raise InputError("not one of the objects could be placed in the container; enlarge it or leave some out")
    problem = Problem([bodies[i] for i in chosen], container)
    scene = problem.scene(device)
    rotation = poses.rotation.to(scene.device, scene.dtype)
    translation = poses.translation.to(scene.device, scene.dtype)
    images = render(scene.outlines, rotation, translation, scene.views, settings.resolution).cpu().numpy()
    losses = np.concatenate([np.zeros((0, len(LOSS_NAMES)), np.float32), *history])
    arrangement = Arrangement(
        problem=problem,
        settings=settings,
        rotation=poses.rotation.double().cpu(),
        translation=poses.translation.double().cpu(),
        images=images,
        targets=scene.container_silhouettes(settings.resolution).cpu().numpy(),
        cameras=scene.cameras,
        history=losses,
        pulls=np.concatenate([np.zeros((0, len(LOSS_NAMES) - 1), np.float32), *pulls]),
        interrupted=interrupted,
    )
    certificate = certify(problem.bodies, arrangement.matrices, container, TOLERANCE, clearance)
    return Packing(arrangement, certificate, list(chosen), losses, list(rounds))


def finish_anew(
    packed: Packing,
    pool: Sequence[Body],
    chosen: list[int],
    poses: Poses,
    container: Container,
    device: str | torch.device = "cpu",
    clearance: Clearance | None = None,
) -> Packing:
    """What was made of a packing by other means: the pool's objects `chosen` at `poses`, drawn and certified anew; the
    search's settings and record are kept. clearance : of the pool. Raises InputError if nothing was chosen."""
    return finish(
        pool,
        chosen,
        poses,
        container,
        packed.arrangement.settings,
        device,
        history=[packed.history],
        rounds=packed.rounds,
        pulls=[packed.arrangement.pulls],
        interrupted=packed.arrangement.interrupted,
        clearance=None if clearance is None else (clearance.parts[chosen], clearance.wall),
    )
