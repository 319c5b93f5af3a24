"""Arrangements recorded as poses and losses, and shown again without the kit: a page, or a notebook's cell."""

from __future__ import annotations

import itertools
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch

from .. import query_points
from ..geometry.cameras import Camera, box_views
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..geometry.sdf import GridStack
from ..io.atomic_files import whole
from ..objective import LOSS_NAMES
from ..optimizer import Arrangement, Step, optimize
from ..poses import Poses, file_to_world
from ..problem import Problem, Settings
from ..util.errors import InputError
from . import recording_format, recording_page, summary

FRAMES = 100
POINTS = 8000  # lattice points by which a frame's overlap is counted
AWAY = 1e3  # metres, where a body is put that is not there
MOST_VIEWS = 3  # shadows that are shown; where there are more views, those of a box are


@dataclass(frozen=True)
class Run:
    """The F frames of one run of N bodies.

    values : of what differs from other runs, such as {"lambda": 0.001}. iterations `(F,)`: after how many a frame is;
    total : how many were made. rotation `(F, N, 3, 3)`, translation `(F, N, 3)`: of the bodies' centres, float64.
    present `(F, N)`: which bodies are there. losses `(F, 5)`: columns `objective.LOSS_NAMES`, NaN where there are none;
    those of the last frame are of the iteration before it.
    overlap `(F,)`: share of the container that two or more bodies fill, by lattice points.
    """

    values: dict[str, float]
    iterations: np.ndarray
    total: int
    rotation: np.ndarray
    translation: np.ndarray
    present: np.ndarray
    losses: np.ndarray
    overlap: np.ndarray


class Recorder:
    """Keeps poses and losses of a run: the `callback` of `optimizer.optimize`, or what a search tells its poses.

    frames : about how many are kept, the first and the last among them. It only looks on: with it a run gives the same
    poses bit for bit. Raises InputError where fewer than two frames are asked for.
    """

    def __init__(self, bodies: Sequence[Body], container: Container, frames: int = FRAMES):
        if frames < 2:
            raise InputError(f"a recording needs 2 frames or more, got {frames}")
        self.bodies, self.container, self.frames = list(bodies), container, frames
        self._kept: list[tuple] = []
        self._stride, self._seen, self._iterations = 1, 0, 0
        self._last: torch.Tensor | None = None

    def __call__(self, step: Step) -> None:
        """After an iteration. Raises InputError where it is of several starts at once."""
        if step.translation.dim() != 2:
            raise InputError("a recording is of one start; call optimize for each, with a recorder of its own")
        self.watch(range(len(self.bodies)), Poses(step.rotation, step.translation), step.losses)

    def watch(self, chosen: Sequence[int], poses: Poses, losses: torch.Tensor | None = None) -> None:
        """The bodies `chosen` are at `poses`, and no others are there. losses : of the iteration, if it is one."""
        if self._seen % self._stride == 0:
            self._keep(chosen, poses, losses)
        self._seen += 1
        if losses is not None:
            self._iterations, self._last = self._iterations + 1, losses
        if len(self._kept) == 4 * self.frames:
            self._kept, self._stride = self._kept[::2], 2 * self._stride

    def run(self, chosen: Sequence[int], poses: Poses, values: dict[str, float] | None = None) -> Run:
        """What was kept, and where the bodies `chosen` ended up. values : as in `Run`."""
        self._keep(chosen, poses, self._last)
        last = self._kept.pop()
        even = np.linspace(0, self._seen, self.frames)[:-1] / self._stride
        at = np.unique(even.round().astype(int).clip(max=len(self._kept) - 1)) if self._kept else []
        kept = [*(self._kept[k] for k in at), last]
        count = len(self.bodies)
        rotation = np.tile(np.eye(3), (len(kept), count, 1, 1))
        translation, present = np.zeros((len(kept), count, 3)), np.zeros((len(kept), count), bool)
        for k, (_, there, turn, place, _) in enumerate(kept):
            rotation[k, there], translation[k, there], present[k, there] = turn, place, True
        iterations, losses = np.array([one[0] for one in kept]), np.array([one[4] for one in kept])
        ever = present.any(0)
        overlap = self._overlap(ever, rotation[:, ever], np.where(present[..., None], translation, AWAY)[:, ever])
        return Run(values or {}, iterations, self._iterations, rotation, translation, present, losses, overlap)

    def recording(self, chosen: Sequence[int], poses: Poses, viewing_volume: float) -> Recording:
        """A recording of that run alone; viewing_volume : as in `Settings`."""
        return Recording(
            self.bodies, self.container, [self.run(chosen, poses)], container_views(self.container, viewing_volume)
        )

    def _keep(self, chosen: Sequence[int], poses: Poses, losses: torch.Tensor | None) -> None:
        known = np.full(len(LOSS_NAMES), np.nan) if losses is None else losses.double().cpu().numpy()
        turn, place = (part.detach().double().cpu().numpy().copy() for part in (poses.rotation, poses.translation))
        self._kept.append((self._iterations, list(chosen), turn, place, known))

    def _overlap(self, ever: np.ndarray, rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
        bodies = [body for body, there in zip(self.bodies, ever, strict=True) if there]
        stack = GridStack.of_bodies(bodies)
        half = torch.tensor(np.array([body.half_extents for body in bodies]), dtype=torch.float32)
        lattice = query_points.query_lattice(self.container, POINTS)
        shares = []
        for turn, place in zip(rotation, translation, strict=True):
            poses = (torch.from_numpy(part).float() for part in (turn, place))
            taken = query_points.occupancy(stack, half, *poses, lattice).flatten()
            taken = taken if lattice.inside is None else taken[lattice.inside]
            shares.append(float((taken >= 2).float().mean()))
        return np.array(shares)


class Recording:
    """Runs of the same bodies in the same container, to be looked at side by side.

    In a notebook it shows itself, with sliders for the iteration and for what differs between runs; `save` writes it
    as a page. Bodies that no run has are left out. cameras : whose shadows are shown, orthographic, three at most; None
    for the container's own, or where those are more the three faces of a box.
    Raises InputError for no run, perspective, too many cameras, and runs whose values do not fill a grid.
    """

    title = "A recorded run"

    def __init__(
        self, bodies: Sequence[Body], container: Container, runs: Sequence[Run], cameras: Sequence[Camera] | None = None
    ):
        cameras = container_views(container) if cameras is None else list(cameras)
        if len(cameras) > MOST_VIEWS or any(camera.projection != "orthographic" for camera in cameras):
            raise InputError(f"a recording shows at most {MOST_VIEWS} shadows, all orthographic; leave cameras out")
        if not runs:
            raise InputError("a recording needs a run, got none")
        self.varied = {name: sorted({run.values.get(name) for run in runs}) for name in runs[0].values}
        combinations = set(itertools.product(*self.varied.values()))
        if len(runs) != len(combinations) or {tuple(run.values.values()) for run in runs} != combinations:
            raise InputError(f"runs must have each combination of {', '.join(self.varied) or 'values'} once")
        ever = np.any([run.present.any(0) for run in runs], 0)
        self.bodies = [body for body, there in zip(bodies, ever, strict=True) if there]
        self.runs = [
            replace(
                run,
                rotation=run.rotation[:, ever],
                translation=run.translation[:, ever],
                present=run.present[:, ever],
            )
            for run in runs
        ]
        self.container, self.cameras = container, cameras

    def encoded(self) -> dict:
        """As plain values for JSON, see `recording_format`; a hundred frames of 20 objects take some 45 KB."""
        return recording_format.encode(self.bodies, self.container, self.cameras, self.varied, self.runs)

    def page(self) -> str:
        """The HTML page that shows it, from the file system and without network."""
        return recording_page.page(json.dumps(self.encoded()), self.title)

    def save(self, path: str | Path) -> Path:
        """Write its page; or its data alone, where the name ends in .json. Raises InputError where it cannot be
        written."""
        path = Path(path)
        text = json.dumps(self.encoded()) if path.suffix == ".json" else self.page()
        try:
            with whole(path) as part:
                part.write_text(text, encoding="utf-8")
        except OSError as error:
            raise InputError(f"{path}: cannot be written ({error.strerror}); name another file") from error
        return path

    def __repr__(self) -> str:
        varied = "".join(f", {name} {', '.join(f'{v:g}' for v in values)}" for name, values in self.varied.items())
        return (
            f"<Recording of {len(self.bodies)} objects, {sum(len(run.iterations) for run in self.runs)} frames{varied}>"
        )

    def _repr_mimebundle_(self, include=None, exclude=None) -> dict:
        run = self.runs[0]
        there = run.present[-1]
        bodies = [body for body, is_there in zip(self.bodies, there, strict=True) if is_there]
        rotation, translation = (torch.from_numpy(part[-1][there]) for part in (run.rotation, run.translation))
        picture = summary.picture_html(bodies, file_to_world(bodies, rotation, translation), self.container)
        return recording_page.bundle(json.dumps(self.encoded()), repr(self), picture)


def record(
    bodies: Sequence[Body],
    container: Container,
    settings: Settings | None = None,
    *,
    lambdas: Sequence[float] = (),
    epsilons: Sequence[float] = (),
    frames: int = FRAMES,
    start: Poses | None = None,
) -> Recording:
    """Arrange the bodies by Eq. 1 with each lambda and each epsilon, and record every run.

    lambdas, epsilons : instead of the settings' own; a slider for each. frames, start : of each run.
    Raises InputError as `optimizer.optimize` and `Recorder` do, and for values that are named twice.

    >>> import rasp_core as rasp
    >>> from data_fetch import kitchen_like
    >>> from rasp_core.problem import Settings
    >>> quick = Settings(iterations=20, resolution=64, query_points=2000)
    >>> rasp.record(kitchen_like(3), rasp.box(0.3, 0.3, 0.3), quick, lambdas=[0.001, 0.1], frames=10)
    <Recording of 3 objects, 20 frames, lambda 0.001, 0.1>
    """
    settings, problem = settings or Settings(), Problem(list(bodies), container)
    start = start or Poses.random(problem.bodies, container, settings.seed)
    named = {"lambda": ("lambda_", lambdas), "epsilon (m)": ("epsilon", epsilons)}
    named = {name: (field, [float(v) for v in values]) for name, (field, values) in named.items() if len(values)}
    runs = []
    for combination in itertools.product(*(values for _, values in named.values())):
        values = dict(zip(named, combination, strict=True))
        chosen = replace(settings, **{named[name][0]: value for name, value in values.items()})
        recorder = Recorder(problem.bodies, container, frames)
        run: Arrangement = optimize(problem, chosen, start, callback=recorder)
        runs.append(recorder.run(range(len(problem.bodies)), run.poses, values))
    return Recording(problem.bodies, container, runs, container_views(container, settings.viewing_volume))


def container_views(container: Container, viewing_volume: float = Settings.viewing_volume) -> list[Camera]:
    """The views whose shadows are shown: the container's, or where those are too many the three faces of a box."""
    views = container.views(viewing_volume)
    return views if len(views) <= MOST_VIEWS else box_views(views[0].width, views[0].centre)
