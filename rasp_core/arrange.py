"""The one optimisation loop: poses of rigid bodies by Adam on Eq. 1. Packing, assembly and art call it."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from tqdm.auto import tqdm

from . import losses, poses
from .cameras import Camera
from .containers import Container
from .errors import InputError
from .meshes import Body
from .scene import Scene
from .silhouettes import render

ROTATIONS = ("angles", "quaternion")
NEIGHBOUR_REACH = 0.01  # of the viewing width: how far the contact term looks around
NEIGHBOUR_LIFE = 10  # iterations for which its neighbours are kept
LOSS_NAMES = ("total", "silhouette", "overlap", "extrusion", "contact")


@dataclass(frozen=True)
class Settings:
    """How to optimise. The defaults are the paper's where it gives them.

    iterations, learning_rate, final_learning_rate : Adam, the rate falling geometrically; for translations it is
        in units of the viewing width, for rotations in radians.
    lambda_, epsilon : weight (per metre) and depth (metres) of the extrusion term (Eq. 1, 5).
    silhouette_weight, overlap_weight, contact_weight : of Eq. 2, Eq. 4 and the kit's surface contact, which the
        paper does not have (0). Contact is divided by the volume of a query point, which gives it Eq. 4's unit.
    contact_margin : metres that a body keeps from walls and, twice, from others, under the contact term.
    overlap_term : "shared" or "as_printed", see `losses.overlap`.
    query_points, jitter : how many, and whether the lattice is shifted at random at every iteration, so that no
        overlap hides between its points (the paper's points are fixed).
    resolution : pixels along an image's edge.
    softness_px, final_softness_px : blur of the silhouettes' difference, falling geometrically, for a 256 pixel image.
    rotation : "angles" (three angles -> quaternion -> rotation, the paper's) or "quaternion".
    """

    iterations: int = 1000
    learning_rate: float = 1e-2
    final_learning_rate: float = 1e-4
    lambda_: float = losses.LAMBDA
    epsilon: float = losses.EPSILON
    silhouette_weight: float = 1.0
    overlap_weight: float = 1.0
    contact_weight: float = 0.0
    contact_margin: float = 0.0
    overlap_term: str = "shared"
    query_points: int = losses.QUERY_POINTS
    jitter: bool = True
    resolution: int = 256
    softness_px: float = 8.0
    final_softness_px: float = 1.0
    rotation: str = "angles"
    seed: int = 0

    def __post_init__(self):
        for name in ("iterations", "query_points", "resolution", "learning_rate", "final_learning_rate"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name} must be positive, got {getattr(self, name)}")
        for name in ("lambda_", "silhouette_weight", "overlap_weight", "contact_weight", "softness_px"):
            if not getattr(self, name) >= 0:
                raise InputError(f"{name} must not be negative, got {getattr(self, name)}")
        if self.rotation not in ROTATIONS:
            raise InputError(f"rotation {self.rotation!r} is unknown; use one of {', '.join(ROTATIONS)}")
        if self.overlap_term not in losses.OVERLAP_TERMS:
            raise InputError(f"overlap_term {self.overlap_term!r} is unknown; use {' or '.join(losses.OVERLAP_TERMS)}")

    def rate(self, iteration: int) -> float:
        """Adam's step at an iteration."""
        return _fall(self.learning_rate, self.final_learning_rate, iteration / self.iterations)

    def softness(self, iteration: int) -> float:
        """The blur at an iteration, in pixels of `resolution`; 0 where `softness_px` is 0."""
        if self.softness_px == 0:
            return 0.0
        fallen = _fall(self.softness_px, max(self.final_softness_px, 1e-3), iteration / self.iterations)
        return fallen * self.resolution / 256


@dataclass(frozen=True)
class Problem:
    """What to arrange: bodies in a container before cameras, with targets `(K, H, W)` in [0, 1], row 0 on top.

    cameras None: the container's own views; targets None: the container's own silhouettes.
    """

    bodies: Sequence[Body]
    container: Container
    cameras: Sequence[Camera] | None = None
    targets: np.ndarray | None = None

    def scene(self, device: str | torch.device = "cpu", dtype: torch.dtype = torch.float32) -> Scene:
        """The problem's tensors on a device."""
        return Scene(self.bodies, self.container, self.cameras or self.container.views(), device, dtype)


@dataclass(frozen=True)
class Start:
    """Poses to start from: rotation `(N, 3, 3)`, translation `(N, 3)` of the bodies' centres, world."""

    rotation: Tensor
    translation: Tensor

    @classmethod
    def random(cls, bodies: Sequence[Body], container: Container, seed: int) -> Start:
        """Uniform rotations, centres uniform inside the container, as the paper starts."""
        generator = torch.Generator().manual_seed(seed)
        rotation = poses.quaternion_to_rotation(poses.random_quaternions(len(bodies), generator))
        return cls(rotation, container.random_points(len(bodies), generator))

    def take(self, indices: Sequence[int]) -> Start:
        """The poses of some of the bodies."""
        index = torch.as_tensor(list(indices), dtype=torch.int64)
        return Start(self.rotation[index], self.translation[index])


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
        return file_to_world(self.problem.bodies, self.rotation, self.translation)

    @property
    def start(self) -> Start:
        """These poses as the start of a next run."""
        return Start(self.rotation, self.translation)


@dataclass(frozen=True)
class Step:
    """What a callback sees after an iteration: poses before it, and losses as tensors in the order of LOSS_NAMES."""

    iteration: int
    losses: Tensor
    rotation: Tensor
    translation: Tensor
    images: Tensor | None


def file_to_world(bodies: Sequence[Body], rotation: Tensor, translation: Tensor) -> np.ndarray:
    """Poses of the bodies' centres -> `(N, 4, 4)` matrices that place the vertices of their files."""
    matrices = poses.to_matrix(rotation.double().cpu(), translation.double().cpu()).numpy()
    centres = np.array([body.centre for body in bodies])
    matrices[:, :3, 3] -= np.einsum("nij,nj->ni", matrices[:, :3, :3], centres)
    return matrices


def arrange(
    problem: Problem,
    settings: Settings | None = None,
    start: Start | None = None,
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
    are at hand. callback : called after each iteration; a true answer ends the run. progress : a bar on standard error.
    checkpoint : a file that the state is written to every `checkpoint_every` iterations and at the end; where it is
    there already, the run goes on from it, to the same result bit for bit.

    The same settings, start, machine and device give the same poses bit for bit. Ctrl-C ends the run and returns
    what there is. Raises InputError for targets that do not fit the views, or a checkpoint of another run.
    """
    settings = settings or Settings()
    scene = scene or problem.scene(device, dtype)
    start = start or Start.random(problem.bodies, problem.container, settings.seed)
    targets = _targets(problem, scene, settings.resolution)
    lattice = losses.query_lattice(scene.container, settings.query_points, scene.device, scene.dtype)
    variables = _Variables(start, scene, settings)
    optimiser = torch.optim.Adam(variables.parameters, lr=settings.learning_rate)
    rows: list[Tensor] = []
    first = _resume(checkpoint, variables, optimiser, settings, rows) if checkpoint else 0
    generator = torch.Generator()
    interrupted, near = False, None
    with tqdm(total=settings.iterations, initial=first, disable=not progress, desc="arrange", leave=False) as bar:
        try:
            for iteration in range(first, settings.iterations):
                generator.manual_seed(settings.seed * 1_000_003 + iteration)
                shift = torch.rand(3, generator=generator).to(scene.device, scene.dtype) - 0.5
                points = lattice.shifted(shift) if settings.jitter else lattice
                rotation, translation = variables.poses()
                if settings.contact_weight and iteration % NEIGHBOUR_LIFE == 0:
                    near = find_neighbours(scene, rotation, translation, settings)
                values, images = evaluate(scene, rotation, translation, targets, points, settings, iteration, near)
                optimiser.zero_grad(set_to_none=True)
                values[0].backward()
                variables.set_rate(optimiser, settings.rate(iteration))
                optimiser.step()
                rows.append(values.detach())
                bar.update()
                if progress and iteration % 20 == 0:
                    bar.set_postfix({n: f"{v:.3g}" for n, v in zip(LOSS_NAMES, rows[-1].tolist(), strict=True)})
                if checkpoint and (iteration + 1) % checkpoint_every == 0:
                    _save(checkpoint, iteration + 1, variables, optimiser, settings, rows)
                step = Step(iteration, rows[-1], rotation.detach(), translation.detach(), images)
                if callback and callback(step):
                    interrupted = True
                    break
        except KeyboardInterrupt:
            interrupted = True
    if checkpoint:
        _save(checkpoint, len(rows), variables, optimiser, settings, rows)
    with torch.no_grad():
        rotation, translation = variables.poses()
        images = render(scene.outlines, rotation, translation, scene.views, settings.resolution)
    history = torch.stack(rows).cpu().numpy() if rows else np.zeros((0, len(LOSS_NAMES)), np.float32)
    return Arrangement(
        problem,
        settings,
        rotation.double().cpu(),
        translation.double().cpu(),
        images.float().cpu().numpy(),
        targets.float().cpu().numpy(),
        scene.cameras,
        history,
        interrupted,
    )


def evaluate(scene: Scene, rotation, translation, targets, lattice, settings: Settings, iteration=0, near=None):
    """Eq. 1 at given poses: losses `(5,)` in the order of LOSS_NAMES, and the images or None. Differentiable.

    near : `find_neighbours` of these poses or of nearby ones, found here where None.

    Terms of weight 0 are not computed and count as 0.
    """
    zero = torch.zeros((), device=scene.device, dtype=scene.dtype)
    silhouette = overlap = extrusion = contact = zero
    images = None
    if settings.silhouette_weight:
        images = render(scene.outlines, rotation, translation, scene.views, settings.resolution)
        silhouette = losses.silhouette(images, targets, settings.softness(iteration))
    if settings.overlap_weight:
        overlap = losses.overlap(scene.stack, scene.half, rotation, translation, lattice, settings.overlap_term)
    if settings.lambda_:
        extrusion = losses.extrusion(
            scene.container,
            scene.outlines.vertices,
            scene.outlines.vertex_body,
            scene.radius,
            rotation,
            translation,
            settings.epsilon,
        )
    if settings.contact_weight:
        if near is None:
            near = find_neighbours(scene, rotation, translation, settings)
        margin = torch.full_like(scene.radius, settings.contact_margin)
        contact = losses.contact(scene.stack, scene.samples, near, scene.container, rotation, translation, margin)
        contact = contact / lattice.spacing**3
    total = (
        settings.silhouette_weight * silhouette
        + settings.overlap_weight * overlap
        + settings.lambda_ * extrusion
        + settings.contact_weight * contact
    )
    return torch.stack([total, silhouette, overlap, extrusion, contact]), images


def find_neighbours(scene: Scene, rotation: Tensor, translation: Tensor, settings: Settings) -> losses.Neighbours:
    """The samples that the contact term looks at, for some iterations about these poses."""
    reach = NEIGHBOUR_REACH * scene.width + 2 * settings.contact_margin
    return losses.neighbours(scene.stack, scene.samples, scene.half, rotation, translation, scene.container, reach)


def draw_images(arrangement: Arrangement, device: str | torch.device = "cpu") -> Arrangement:
    """The arrangement with its images drawn anew, after its bodies or poses were changed."""
    scene = arrangement.problem.scene(device)
    place = (x.to(scene.device, scene.dtype) for x in (arrangement.rotation, arrangement.translation))
    images = render(scene.outlines, *place, scene.views, arrangement.settings.resolution)
    return replace(arrangement, images=images.cpu().numpy())


class _Variables:
    """The learned turns and shifts, and the poses that they make of the start."""

    def __init__(self, start: Start, scene: Scene, settings: Settings):
        count = len(scene.bodies)
        self.rotation = start.rotation.to(scene.device, scene.dtype)
        self.translation = start.translation.to(scene.device, scene.dtype)
        if self.rotation.shape != (count, 3, 3) or self.translation.shape != (count, 3):
            raise InputError(f"the start has {len(self.rotation)} poses for {count} objects; give one for each")
        self.width = scene.width
        turn = torch.zeros(count, 3) if settings.rotation == "angles" else torch.tensor([1.0, 0, 0, 0]).repeat(count, 1)
        self.to_rotation = poses.angles_to_rotation if settings.rotation == "angles" else poses.quaternion_to_rotation
        # a quaternion (1, d) turns by 2 d, so half the rate gives both parametrisations the same first step
        self.turn_rate = 1.0 if settings.rotation == "angles" else 0.5
        self.turn = turn.to(scene.device, scene.dtype).requires_grad_()
        self.shift = torch.zeros(count, 3, device=scene.device, dtype=scene.dtype, requires_grad=True)

    @property
    def parameters(self):
        return [{"params": [self.turn]}, {"params": [self.shift]}]

    def poses(self) -> tuple[Tensor, Tensor]:
        return self.to_rotation(self.turn) @ self.rotation, self.translation + self.width * self.shift

    def set_rate(self, optimiser, rate: float) -> None:
        for group, factor in zip(optimiser.param_groups, (self.turn_rate, 1.0), strict=True):
            group["lr"] = rate * factor


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


def _fall(first: float, last: float, share: float) -> float:
    return first * (last / first) ** share


def _identity(settings: Settings, variables: _Variables) -> dict:
    return {"settings": asdict(settings), "count": len(variables.shift)}


def _save(path, iteration, variables, optimiser, settings, rows) -> None:
    """Write the state beside the checkpoint, then move it into place."""
    path = Path(path)
    state = {
        "identity": _identity(settings, variables),
        "iteration": iteration,
        "rows": torch.stack(rows).cpu() if rows else torch.zeros(0, len(LOSS_NAMES)),
        "turn": variables.turn.detach().cpu(),
        "shift": variables.shift.detach().cpu(),
        "rotation": variables.rotation.cpu(),
        "translation": variables.translation.cpu(),
        "adam": optimiser.state_dict(),
    }
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            torch.save(state, file)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _resume(path, variables, optimiser, settings, rows) -> int:
    if not Path(path).exists():
        return 0
    try:
        state = torch.load(path, weights_only=True, map_location=variables.shift.device)
        identity = state["identity"]
    except Exception as error:  # torch.load raises whatever the damage makes zipfile and pickle raise
        raise InputError(f"{path}: not a checkpoint of this kit, or damaged; delete it to start anew") from error
    if identity != _identity(settings, variables):
        raise InputError(f"{path}: a checkpoint of other settings or objects; delete it to start anew")
    with torch.no_grad():
        variables.turn.copy_(state["turn"])
        variables.shift.copy_(state["shift"])
        variables.rotation = state["rotation"]
        variables.translation = state["translation"]
    optimiser.load_state_dict(state["adam"])
    rows.extend(state["rows"])
    return state["iteration"]
