"""The one optimisation loop: poses of rigid bodies by Adam on Eq. 1. Packing, assembly and art call it.

`optimize` is `init`, then `run`, which calls `step` for each iteration.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from tqdm.auto import tqdm

from . import poses
from .contact import Neighbours
from .geometry.cameras import Camera
from .geometry.containers import Container
from .geometry.meshes import Body
from .geometry.silhouette_edges import Views
from .io import checkpoint as checkpoints
from .kernels import dispatch
from .objective import LOSS_NAMES, find_neighbours, objective, pull_shares, pulls, term_weights
from .poses import Poses, Variables
from .problem import Problem, Settings
from .query_points import Lattice, query_lattice
from .scene import Scene
from .silhouettes import render
from .util.adam import Adam
from .util.errors import InputError

NEIGHBOUR_LIFE = 10  # iterations for which its neighbours are kept
PULLS_EVERY = 10  # iterations, after which it is noted how hard each term pulls


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


@dataclass(frozen=True)
class Step:
    """What a callback sees after an iteration: poses before it, and losses as tensors in the order of LOSS_NAMES."""

    iteration: int
    losses: Tensor
    rotation: Tensor
    translation: Tensor
    images: Tensor | None


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
    but resolution, shadow, query_points, rotation and seed, which stay as they were).
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


@dataclass
class State:
    """The loop between two iterations: what it works on, the settings of the next iteration, and what it has learned.

    targets `(K, H, W)`. near : what the contact term looks at, kept for NEIGHBOUR_LIFE iterations. history, pulls : so
    far, as in `Arrangement`.
    """

    scene: Scene
    settings: Settings
    targets: Tensor
    lattice: Lattice
    variables: Variables
    adam: Adam
    identity: dict
    near: Neighbours | None = None
    history: list[Tensor] = field(default_factory=list)
    pulls: list[Tensor] = field(default_factory=list)

    @property
    def iteration(self) -> int:
        """The number of the next iteration, from 0."""
        return len(self.history)

    def poses(self) -> Poses:
        """Of the bodies' centres, as the next iteration finds them."""
        with torch.no_grad():
            return Poses(*self.variables.poses())

    def losses(self) -> np.ndarray:
        """`(I, 5)`, or `(I, S, 5)` with S starts, so far, as in `Arrangement.history`."""
        return self._rows(self.history, len(LOSS_NAMES))

    def pulled(self) -> np.ndarray:
        """`(J, 4)`, or `(J, S, 4)`, so far, as in `Arrangement.pulls`."""
        return self._rows(self.pulls, len(LOSS_NAMES) - 1)

    def _rows(self, rows: list[Tensor], columns: int) -> np.ndarray:
        none = torch.zeros(0, *self.variables.shift.shape[:-2], columns)
        return (torch.stack(rows) if rows else none).cpu().numpy()

    def save(self, path: str | Path) -> None:
        """Write all that the next iteration depends on. Raises OSError where it cannot."""
        learned = {
            "rows": torch.stack(self.history).cpu() if self.history else torch.zeros(0),
            "pulls": torch.stack(self.pulls) if self.pulls else torch.zeros(0),
            "turn": self.variables.turn.detach().cpu(),
            "shift": self.variables.shift.detach().cpu(),
            "rotation": self.variables.start.rotation.cpu(),
            "translation": self.variables.start.translation.cpu(),
            "adam": self.adam.state_dict(),
        }
        checkpoints.save(path, self.identity, learned)

    def load(self, path: str | Path) -> None:
        """Take over what `save` wrote, if it is there. Raises InputError where it is damaged or of another run."""
        learned = checkpoints.load(path, self.identity, self.scene.device)
        if learned is None:
            return
        with torch.no_grad():
            self.variables.turn.copy_(learned["turn"])
            self.variables.shift.copy_(learned["shift"])
        self.variables.start = Poses(learned["rotation"], learned["translation"])
        self.adam.load_state_dict(learned["adam"])
        self.history, self.pulls = list(learned["rows"]), list(learned["pulls"])


def init(problem: Problem, settings: Settings, start: Poses, scene: Scene) -> State:
    """The loop before its first iteration. Raises InputError where start or targets do not fit the problem."""
    count, given = len(scene.bodies), start.rotation.shape[-3]
    if given != count or start.translation.shape[-2] != count:
        raise InputError(f"the start has {given} poses for {count} objects; give one for each")
    targets = problem.target_images(scene, settings.resolution, settings.shadow)
    lattice = query_lattice(scene.container, settings.query_points, scene.device, scene.dtype)
    start = Poses(start.rotation.to(scene.device, scene.dtype), start.translation.to(scene.device, scene.dtype))
    variables = Variables(start, scene.movers, scene.width, settings.rotation, scene.freedom)
    identity = {"settings": asdict(settings), "bodies": [body.digest for body in scene.bodies], "movers": scene.movers}
    return State(scene, settings, targets, lattice, variables, Adam(variables.parameters), identity)


def step(state: State) -> Step:
    """One iteration: Eq. 1 at the present poses, its gradient, and Adam's step against it."""
    iteration, settings, scene = state.iteration, state.settings, state.scene
    rotation, translation = state.variables.poses()
    if settings.contact_weight and iteration % NEIGHBOUR_LIFE == 0:
        state.near = find_neighbours(scene, rotation, translation, settings)
    points = _jittered(state.lattice, settings.seed, iteration) if settings.jitter else state.lattice
    losses, images = objective(scene, rotation, translation, state.targets, points, settings, iteration, state.near)
    if iteration % PULLS_EVERY == 0:
        state.pulls.append(pulls(losses, term_weights(scene, points, settings), translation))
    state.adam.zero_grad()
    losses[..., 0].sum().backward()
    state.adam.step(state.variables.rates(settings.rate(iteration)))
    state.history.append(losses.detach())
    return Step(iteration, state.history[-1], rotation.detach(), translation.detach(), images)


def run(
    state: State,
    callback: Callable[[Step], object] | None = None,
    progress: bool = False,
    checkpoint: str | Path | None = None,
    checkpoint_every: int = 100,
) -> bool:
    """All steps that are left, see `optimize`; True where the callback or Ctrl-C ends them early."""
    iterations = range(state.iteration, state.settings.iterations)
    bar = tqdm(total=iterations.stop, initial=iterations.start, disable=not progress, desc="arrange", leave=False)
    with bar, dispatch.one_torch_thread(state.scene.device):
        try:
            for iteration in iterations:
                found = step(state)
                bar.update()
                if progress and iteration % 20 == 0:
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


def _jittered(lattice: Lattice, seed: int, iteration: int) -> Lattice:
    """The lattice moved by at most half its spacing, at random but the same for the same seed and iteration."""
    generator = torch.Generator().manual_seed(seed * 1_000_003 + iteration)
    return lattice.shifted(torch.rand(3, generator=generator).to(lattice.origin) - 0.5)


def _taken_over(settings: Settings, before: Settings) -> Settings:
    """A callback's settings, but for what stays as it was in a run."""
    return replace(
        settings,
        resolution=before.resolution,
        shadow=before.shadow,
        query_points=before.query_points,
        rotation=before.rotation,
        seed=before.seed,
    )
