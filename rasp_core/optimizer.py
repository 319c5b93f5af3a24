"""The one optimisation loop: poses of rigid bodies by Adam on Eq. 1. Packing, assembly and art call it.

`optimize` is `iteration.init`, then `run`, which calls `iteration.step` for each iteration.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from tqdm.auto import tqdm

from . import poses
from .geometry.cameras import Camera
from .geometry.containers import Container
from .geometry.meshes import Body
from .geometry.silhouette_edges import Views
from .iteration import State, Step, init, played, step
from .kernels import dispatch
from .objective import LOSS_NAMES, pull_shares
from .poses import Poses
from .problem import Problem, Settings
from .scene import Scene
from .silhouettes import render
from .util.errors import InputError

PLAYED = 50  # iterations that a GPU does in a row


@dataclass(frozen=True)
class Arrangement:
    """Where the bodies ended up.

    rotation `(N, 3, 3)`, translation `(N, 3)`: of the bodies' centres, CPU, float64.
    images, targets : `(K, H, W)` float32, as drawn at the end without blur, by `cameras`. Where the targets are the
        container's own, these are close about it, however wide the viewing volume of the run.
    history : one row an iteration, columns LOSS_NAMES.
    pulls : one row every PULLS_EVERY iterations, columns LOSS_NAMES[1:], see `objective.pulls`.
    interrupted : True where Ctrl-C or the callback ended it early.
    """

    problem: Problem
    settings: Settings
    rotation: Tensor
    translation: Tensor
    images: np.ndarray
    targets: np.ndarray
    cameras: Sequence[Camera]
    history: np.ndarray
    interrupted: bool = False
    pulls: np.ndarray = field(default_factory=lambda: np.zeros((0, len(LOSS_NAMES) - 1), np.float32))

    @property
    def bodies(self) -> Sequence[Body]:
        """Those of the problem."""
        return self.problem.bodies

    @property
    def container(self) -> Container:
        """That of the problem."""
        return self.problem.container

    @property
    def matrices(self) -> np.ndarray:
        """`(N, 4, 4)` float64: from each file's coordinates to the world."""
        return poses.file_to_world(self.bodies, self.rotation, self.translation)

    @property
    def poses(self) -> Poses:
        """Of the bodies' centres, to go on from."""
        return Poses(self.rotation, self.translation)

    @property
    def gradient_shares(self) -> dict[str, float]:
        """Each term's share of the gradient with respect to translations, in the mean over the run; 0 without one."""
        return dict(zip(LOSS_NAMES[1:], pull_shares(self.pulls).tolist(), strict=True))


def optimize(
    problem: Problem,
    settings: Settings | None = None,
    start: Poses | None = None,
    device: str | torch.device = "cpu",
    dtype: torch.dtype = torch.float32,
    scene: Scene | None = None,
    callback: Callable[[Step], object] | None = None,
    progress: bool = False,
    checkpoint: str | Path | None = None,
    checkpoint_every: int = 100,
) -> Arrangement:
    """Minimise Eq. 1 over the poses of the bodies.

    start : poses to start from; random ones by `settings.seed` where None. scene : the problem's tensors, where they
    are at hand.
    callback : called after each iteration. True ends the run; other Settings take over from the next iteration on (all
    but resolution, shadow, query_points, query_volume, rotation and seed, which stay as they were).
    progress : a bar on standard error.
    checkpoint : a file that the state is written to every `checkpoint_every` iterations and at the end; where it is
    there already, the run goes on from it, to the same result bit for bit.

    The same settings, start, machine and device give the same poses bit for bit. Ctrl-C ends the run and returns
    what there is. Raises InputError for targets that do not fit the views, or a checkpoint of another run.
    """
    settings = settings or Settings()
    start = start or Poses.random(problem.bodies, problem.container, settings.seed)
    state = init(problem, settings, start, scene or problem.scene(device, dtype, settings.viewing_volume))
    if checkpoint:
        state.load(checkpoint)
    interrupted = run(state, callback, progress, checkpoint, checkpoint_every)
    if checkpoint:
        state.save(checkpoint)
    poses, cameras, targets = state.poses(), state.scene.cameras, state.targets
    if problem.targets is None:
        cameras = problem.cameras or problem.container.views()
        views = Views(cameras, state.scene.device, state.scene.dtype)
        targets = state.scene.container_silhouettes(settings.resolution, views=views)
    views = Views(cameras, state.scene.device, state.scene.dtype)
    images = render(state.scene.outlines, poses.rotation, poses.translation, views, settings.resolution)
    return Arrangement(
        problem,
        state.settings,
        poses.rotation.double().cpu(),
        poses.translation.double().cpu(),
        images.float().cpu().numpy(),
        targets.float().cpu().numpy(),
        cameras,
        state.losses(),
        interrupted,
        state.pulled(),
    )


def optimize_many(
    problem: Problem, starts: Sequence[Poses], settings: Settings | None = None, **options
) -> list[Arrangement]:
    """`optimize` from S starts in one set of tensors, each as it would be alone: S arrangements.

    For few bodies and small images, where most of an iteration goes into calls, many starts cost little more than one.
    options : the others of `optimize`. Raises InputError as `optimize` does, and for no start.
    """
    if not starts:
        raise InputError("there is no start to optimise from; give at least one")
    start = Poses(torch.stack([s.rotation for s in starts]), torch.stack([s.translation for s in starts]))
    together = optimize(problem, settings, start, **options)
    return [
        replace(
            together,
            rotation=together.rotation[k],
            translation=together.translation[k],
            images=together.images[k],
            history=together.history[:, k],
            pulls=together.pulls[:, k],
        )
        for k in range(len(starts))
    ]


def run(
    state: State,
    callback: Callable[[Step], object] | None = None,
    progress: bool = False,
    checkpoint: str | Path | None = None,
    checkpoint_every: int = 100,
) -> bool:
    """All steps that are left, see `optimize`; True where the callback or Ctrl-C ends them early."""
    end, in_a_row = state.settings.iterations, 1 if callback or checkpoint else PLAYED
    bar = tqdm(total=end, initial=state.iteration, disable=not progress, desc="arrange", leave=False)
    with bar, dispatch.one_torch_thread(state.scene.device):
        try:
            for found in _steps(state, end, in_a_row):
                bar.update()
                if progress and found.iteration % 20 == 0:
                    mean = found.losses.view(-1, len(LOSS_NAMES)).mean(0).tolist()
                    bar.set_postfix({n: f"{v:.3g}" for n, v in zip(LOSS_NAMES, mean, strict=True)})
                if checkpoint and state.iteration % checkpoint_every == 0:
                    state.save(checkpoint)
                answer = callback(found) if callback else None
                if isinstance(answer, Settings):
                    state.settings = _taken_over(answer, state.settings)
                elif answer:
                    return True
        except KeyboardInterrupt:
            return True
    return False


def _steps(state: State, end: int, in_a_row: int) -> Iterator[Step]:
    """Iterations until there are `end`; on a GPU `in_a_row` of them are done before the first of them is told."""
    while state.iteration < end:
        settings = state.settings
        if state.scene.device.type != "cuda" or settings.contact_weight or settings.shadow != "silhouette":
            yield step(state)
        else:
            yield from played(state, range(state.iteration, min(end, state.iteration + in_a_row)))


def _taken_over(settings: Settings, before: Settings) -> Settings:
    """A callback's settings, but for what stays as it was in a run."""
    return replace(
        settings,
        resolution=before.resolution,
        shadow=before.shadow,
        query_points=before.query_points,
        query_volume=before.query_volume,
        rotation=before.rotation,
        seed=before.seed,
    )
