"""The one optimisation loop: poses of rigid bodies by Adam on Eq. 1. Packing, assembly and art call it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from tqdm.auto import tqdm

from . import poses
from .geometry.cameras import Camera
from .io import checkpoint as checkpoints
from .kernels import dispatch
from .objective import LOSS_NAMES, find_neighbours, objective
from .poses import Poses
from .problem import Problem, Settings
from .query_points import query_lattice
from .scene import Scene
from .silhouettes import render
from .util.adam import Adam
from .util.errors import InputError

NEIGHBOUR_LIFE = 10  # iterations for which its neighbours are kept


@dataclass(frozen=True)
class Arrangement:
    """Where the bodies ended up.

    rotation `(N, 3, 3)`, translation `(N, 3)`: of the bodies' centres, CPU, float64.
    images, targets : `(K, H, W)` float32, as drawn at the end without blur.
    history : one row an iteration, columns LOSS_NAMES.
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

    @property
    def matrices(self) -> np.ndarray:
        """`(N, 4, 4)` float64: from each file's coordinates to the world."""
        return poses.file_to_world(self.problem.bodies, self.rotation, self.translation)

    @property
    def poses(self) -> Poses:
        """Of the bodies' centres, to go on from."""
        return Poses(self.rotation, self.translation)


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
    start: Poses | Sequence[Poses] | None = None,
    device: str | torch.device = "cpu",
    dtype: torch.dtype = torch.float32,
    scene: Scene | None = None,
    callback: Callable[[Step], object] | None = None,
    progress: bool = False,
    checkpoint: str | Path | None = None,
    checkpoint_every: int = 100,
) -> Arrangement | list[Arrangement]:
    """Minimise Eq. 1 over the poses of the bodies.

    start : poses to start from; random ones by `settings.seed` where None. A list of S starts is optimised in one set
    of tensors, each as it would be alone, into a list of S arrangements: for few bodies and small images, where most of
    an iteration goes into calls, many starts cost little more than one.
    scene : the problem's tensors, where they are at hand.
    callback : called after each iteration. True ends the run; other Settings take over from the next iteration on (all
    but resolution, query_points, rotation and seed, which stay as they were). progress : a bar on standard error.
    checkpoint : a file that the state is written to every `checkpoint_every` iterations and at the end; where it is
    there already, the run goes on from it, to the same result bit for bit.

    The same settings, start, machine and device give the same poses bit for bit. Ctrl-C ends the run and returns
    what there is. Raises InputError for targets that do not fit the views, or a checkpoint of another run.
    """
    settings = settings or Settings()
    scene = scene or problem.scene(device, dtype)
    start = start or Poses.random(problem.bodies, problem.container, settings.seed)
    several = not isinstance(start, Poses)
    if several:
        start = Poses(torch.stack([s.rotation for s in start]), torch.stack([s.translation for s in start]))
    targets = _targets(problem, scene, settings.resolution)
    lattice = query_lattice(scene.container, settings.query_points, scene.device, scene.dtype)
    variables = _Variables(start, scene, settings)
    optimiser = Adam(variables.parameters)
    rows: list[Tensor] = []
    identity = {"settings": asdict(settings), "bodies": [body.digest for body in scene.bodies], "movers": scene.movers}
    kept = checkpoints.load(checkpoint, identity, scene.device) if checkpoint else None
    first = variables.restore(kept, optimiser, rows) if kept else 0
    generator = torch.Generator()
    interrupted, near = False, None
    fixed = {name: getattr(settings, name) for name in ("resolution", "query_points", "rotation", "seed")}
    bar = tqdm(total=settings.iterations, initial=first, disable=not progress, desc="arrange", leave=False)
    with bar, dispatch.alone(scene.device):
        try:
            for iteration in range(first, settings.iterations):
                generator.manual_seed(settings.seed * 1_000_003 + iteration)
                shift = torch.rand(3, generator=generator).to(scene.device, scene.dtype) - 0.5
                points = lattice.shifted(shift) if settings.jitter else lattice
                rotation, translation = variables.poses()
                if settings.contact_weight and iteration % NEIGHBOUR_LIFE == 0:
                    near = find_neighbours(scene, rotation, translation, settings)
                values, images = objective(scene, rotation, translation, targets, points, settings, iteration, near)
                optimiser.zero_grad()
                values[..., 0].sum().backward()
                optimiser.step(variables.rates(settings.rate(iteration)))
                rows.append(values.detach())
                bar.update()
                if progress and iteration % 20 == 0:
                    mean = rows[-1].view(-1, len(LOSS_NAMES)).mean(0).tolist()
                    bar.set_postfix({n: f"{v:.3g}" for n, v in zip(LOSS_NAMES, mean, strict=True)})
                if checkpoint and (iteration + 1) % checkpoint_every == 0:
                    checkpoints.save(checkpoint, identity, variables.state(iteration + 1, optimiser, rows))
                step = Step(iteration, rows[-1], rotation.detach(), translation.detach(), images)
                answer = callback(step) if callback else None
                if isinstance(answer, Settings):
                    settings = replace(answer, **fixed)
                elif answer:
                    interrupted = True
                    break
        except KeyboardInterrupt:
            interrupted = True
    if checkpoint:
        checkpoints.save(checkpoint, identity, variables.state(len(rows), optimiser, rows))
    with torch.no_grad():
        rotation, translation = variables.poses()
        images = render(scene.outlines, rotation, translation, scene.views, settings.resolution)
    history = torch.stack(rows).cpu() if rows else torch.zeros(0, *translation.shape[:-2], len(LOSS_NAMES))
    targets = targets.float().cpu().numpy()

    def arrangement(rotation, translation, images, history) -> Arrangement:
        place, pictures = (rotation.double().cpu(), translation.double().cpu()), images.float().cpu().numpy()
        return Arrangement(problem, settings, *place, pictures, targets, scene.cameras, history.numpy(), interrupted)

    if several:
        each = zip(rotation, translation, images, history.unbind(1), strict=True)
        return [arrangement(*one) for one in each]
    return arrangement(rotation, translation, images, history)


class _Variables:
    """The learned turns and shifts of the bodies that may move, and the poses that they make of the start."""

    def __init__(self, start: Poses, scene: Scene, settings: Settings):
        count = len(scene.bodies)
        self.rotation = start.rotation.to(scene.device, scene.dtype)
        self.translation = start.translation.to(scene.device, scene.dtype)
        if self.rotation.shape[-3:] != (count, 3, 3) or self.translation.shape[-2:] != (count, 3):
            raise InputError(f"the start has {self.rotation.shape[-3]} poses for {count} objects; give one for each")
        self.width = scene.width
        still = torch.zeros(3) if settings.rotation == "angles" else torch.tensor([1.0, 0, 0, 0])
        self.movers = scene.movers
        turn = still.expand(*self.translation.shape[:-2], self.movers, len(still)).clone()
        self.to_rotation = poses.angles_to_rotation if settings.rotation == "angles" else poses.quaternion_to_rotation
        # a quaternion (1, d) turns by 2 d, so half the rate gives both parametrisations the same first step
        self.turn_rate = 1.0 if settings.rotation == "angles" else 0.5
        self.turn = turn.to(scene.device, scene.dtype).requires_grad_()
        self.shift = torch.zeros_like(self.translation[..., : self.movers, :], requires_grad=True)

    @property
    def parameters(self) -> list[Tensor]:
        return [self.turn, self.shift]

    def state(self, iteration: int, optimiser, rows: list[Tensor]) -> dict:
        """All that the next iteration depends on."""
        return {
            "iteration": iteration,
            "rows": torch.stack(rows).cpu() if rows else torch.zeros(0),
            "turn": self.turn.detach().cpu(),
            "shift": self.shift.detach().cpu(),
            "rotation": self.rotation.cpu(),
            "translation": self.translation.cpu(),
            "adam": optimiser.state_dict(),
        }

    def restore(self, state: dict, optimiser, rows: list[Tensor]) -> int:
        """Take a `state` over; returns its iteration."""
        with torch.no_grad():
            self.turn.copy_(state["turn"])
            self.shift.copy_(state["shift"])
        self.rotation, self.translation = state["rotation"], state["translation"]
        optimiser.load_state_dict(state["adam"])
        rows.extend(state["rows"])
        return state["iteration"]

    def poses(self) -> tuple[Tensor, Tensor]:
        rotation = self.to_rotation(self.turn) @ self.rotation[..., : self.movers, :, :]
        translation = self.translation[..., : self.movers, :] + self.width * self.shift
        if self.movers == self.translation.shape[-2]:
            return rotation, translation
        obstacles = self.rotation[..., self.movers :, :, :], self.translation[..., self.movers :, :]
        return torch.cat([rotation, obstacles[0]], -3), torch.cat([translation, obstacles[1]], -2)

    def rates(self, rate: float) -> list[float]:
        return [rate * self.turn_rate, rate]


def _targets(problem: Problem, scene: Scene, resolution: int) -> Tensor:
    if problem.targets is None:
        return scene.container_silhouettes(resolution)
    targets = torch.as_tensor(np.asarray(problem.targets), device=scene.device, dtype=scene.dtype)
    if targets.shape != (len(scene.cameras), resolution, resolution):
        raise InputError(
            f"targets have shape {tuple(targets.shape)}; {len(scene.cameras)} views of {resolution} x {resolution} "
            "pixels are needed"
        )
    return targets
