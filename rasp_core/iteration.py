"""One iteration of the loop: Eq. 1 at the present poses, its gradient, and Adam's step; and what it is done to."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from .io import checkpoint as checkpoints
from .kernels.surface_contact import Neighbours
from .objective import LOSS_NAMES, find_neighbours, objective, pulls, term_weights
from .poses import Poses, Variables
from .problem import Problem, Settings
from .query_points import Lattice, query_lattice
from .scene import Scene
from .util.adam import Adam
from .util.errors import InputError
from .util.replay import Replay

NEIGHBOUR_LIFE = 10  # iterations for which its neighbours are kept
PULLS_EVERY = 10  # iterations, after which it is noted how hard each term pulls


@dataclass(frozen=True)
class Step:
    """What a callback sees after an iteration: poses before it, and losses as tensors in the order of LOSS_NAMES."""

    iteration: int
    losses: Tensor
    rotation: Tensor
    translation: Tensor
    images: Tensor | None


@dataclass
class State:
    """The loop between two iterations: what it works on, the settings of the next iteration, and what it has learned.

    targets `(K, H, W)`. near : what the contact term looks at, kept for NEIGHBOUR_LIFE iterations. history, pulls : so
    far, as in `Arrangement`. replay : on a GPU the recorded iteration, and the settings that it was recorded with.
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
    replay: tuple[Settings, Replay] | None = None

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
            "pulls": torch.stack(self.pulls).cpu() if self.pulls else torch.zeros(0),
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
    lattice = query_lattice(scene.container, settings.query_points, scene.device, scene.dtype, settings.query_volume)
    start = Poses(start.rotation.to(scene.device, scene.dtype), start.translation.to(scene.device, scene.dtype))
    variables = Variables(start, scene.movers, scene.width, settings.rotation, scene.freedom)
    identity = {"settings": asdict(settings), "bodies": [body.digest for body in scene.bodies], "movers": scene.movers}
    return State(scene, settings, targets, lattice, variables, Adam(variables.parameters), identity)


def step(state: State) -> Step:
    """One iteration: Eq. 1 at the present poses, its gradient, and Adam's step against it."""
    iteration, settings = state.iteration, state.settings
    if settings.contact_weight and iteration % NEIGHBOUR_LIFE == 0:
        now = state.poses()
        state.near = find_neighbours(state.scene, now.rotation, now.translation, settings)
    rate, softness_px, *shift = _moment(settings, iteration)
    return _noted(state, *_iterate(state, rate, softness_px, torch.tensor(shift), iteration % PULLS_EVERY == 0))


def played(state: State, iterations: range) -> list[Step]:
    """These iterations as `step` does them, on a GPU, from a record; where contact and slices have no part."""
    settings = state.settings
    if state.replay is None or state.replay[0] is not settings:

        def work(row: Tensor, noted: bool):
            return _iterate(state, row[0], row[1] if settings.softness_px else 0.0, row[2:], noted)

        state.replay = settings, Replay(work, 5, state.adam.tensors())
    rows = torch.tensor([_moment(settings, i) for i in iterations], dtype=torch.float64)
    noted = [i % PULLS_EVERY == 0 for i in iterations]
    played = state.replay[1].play(rows.to(state.scene.device, state.scene.dtype), noted)
    return [_noted(state, *results) for results in played]


def _iterate(state: State, rate, softness_px, shift: Tensor, noted: bool) -> tuple[Tensor | None, ...]:
    """The work of one iteration: losses, how hard each term pulls if that is `noted`, poses before it, and images.

    rate, softness_px, shift : of `_moment`, as numbers or tensors.
    """
    scene, settings = state.scene, state.settings
    rotation, translation = state.variables.poses()
    points = state.lattice.shifted(shift.to(state.lattice.origin)) if settings.jitter else state.lattice
    losses, images = objective(scene, rotation, translation, state.targets, points, settings, softness_px, state.near)
    pulled = pulls(losses, term_weights(scene, points, settings), translation) if noted else None
    state.adam.zero_grad()
    losses[..., 0].sum().backward()
    state.adam.step(state.variables.rates(rate))
    images = None if images is None else images.detach()
    return losses.detach(), pulled, rotation.detach(), translation.detach(), images


def _noted(state: State, losses, pulled, rotation, translation, images) -> Step:
    """The iteration is done."""
    if pulled is not None:
        state.pulls.append(pulled)
    state.history.append(losses)
    return Step(state.iteration - 1, losses, rotation, translation, images)


def _moment(settings: Settings, iteration: int) -> tuple[float, ...]:
    """What differs from iteration to iteration: the rate, the blur, and by how much of its spacing the lattice is moved
    along x, y, z: by half at most, at random but the same for the same seed and iteration."""
    generator = torch.Generator().manual_seed(settings.seed * 1_000_003 + iteration)
    shift = torch.rand(3, generator=generator) - 0.5
    return settings.rate(iteration), settings.softness(iteration), *shift.tolist()
