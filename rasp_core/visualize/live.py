"""An arrangement on its own thread, to be watched, paused and changed while it runs: what the sliders drive."""

from __future__ import annotations

import atexit
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
import torch
from torch import Tensor

from .. import losses, query_points
from ..exact.certificate import Certificate, certify
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..iteration import Step
from ..objective import LOSS_NAMES
from ..optimizer import optimize
from ..poses import Poses, file_to_world
from ..problem import Problem, Settings
from ..scene import Scene
from ..silhouettes import render
from ..util.errors import InputError

EVERY = 0.12  # seconds between two frames, at least
POINTS = 8000  # lattice points by which a frame's overlap and density are counted


@dataclass(frozen=True)
class Controls:
    """What may be changed while it runs.

    weighting, lambda_, epsilon, overlap_term : as in `Settings`, from the next iteration on. count : how many objects
    of the pool, seed : of their random poses; a change of either starts anew. height : the target silhouettes are those
    of the container squeezed upon its floor to this share of its height; the poses stay.
    """

    weighting: str = Settings.weighting
    lambda_: float = losses.LAMBDA
    epsilon: float = losses.EPSILON
    overlap_term: str = "shared"
    count: int = 20
    seed: int = 0
    height: float = 1.0


@dataclass(frozen=True)
class Frame:
    """What there is to see after an iteration.

    matrices `(N, 4, 4)`: from the files of the first N bodies to the world. images, targets `(K, H, W)`. history: one
    row an iteration, columns `objective.LOSS_NAMES`. density, overlap : share of the container that bodies fill, and
    that two or more do, by lattice points. certificate : of exact booleans, where all iterations are done, else None.
    """

    matrices: np.ndarray
    images: np.ndarray
    targets: np.ndarray
    history: np.ndarray
    density: float
    overlap: float
    certificate: Certificate | None


class State(Enum):
    """What a run was last told to do."""

    RESTING = "resting"
    RUNNING = "running"
    CLOSED = "closed"


@dataclass(frozen=True)
class _Wanted:
    """What was asked for, replaced as a whole by each command. steps : iterations to make before it rests; anew : from
    the random poses."""

    controls: Controls
    state: State = State.RESTING
    steps: int = 0
    anew: bool = True

    def ends(self, under_way: Controls) -> bool:
        """Whether what is under way must end first."""
        return self.state is State.CLOSED or self.anew or self.controls.height != under_way.height

    def acts(self, under_way: Controls) -> bool:
        """Whether there is something to do."""
        return self.state is State.RUNNING or self.steps > 0 or self.ends(under_way)


class LiveRun:
    """Arranges the first objects of a pool in a container, on a thread that begins with the first command.

    watch : called with each `Frame`, on that thread. What it raises, or the run does, ends the thread and is raised by
    `wait`. settings : for what `controls` does not name; when the `iterations` are done it rests, and `run` goes on for
    as many again. Raises InputError where the controls do not fit the pool.
    """

    def __init__(
        self,
        pool: Sequence[Body],
        container: Container,
        controls: Controls | None = None,
        settings: Settings | None = None,
        watch: Callable[[Frame], object] = lambda frame: None,
    ):
        self.pool, self.container, self.watch = list(pool), container, watch
        self.settings = settings or Settings()
        controls = controls or Controls(count=min(Controls.count, len(self.pool)))
        self._check(controls)
        self._changed = threading.Condition()  # guards the three below
        self._wanted = _Wanted(controls)
        self._waiting = False
        self._error: BaseException | None = None
        self._thread: threading.Thread | None = None
        self._scenes: dict[int, Scene] = {}
        self._lattice = query_points.query_lattice(container, POINTS)
        self._rows: list[Tensor] = []

    # -- commands, from any thread -----------------------------------------------------------------------------------

    @property
    def controls(self) -> Controls:
        """What was last asked for."""
        return self._wanted.controls

    def run(self) -> None:
        """Go on until `pause`, or the settings' iterations are done."""
        self._command(lambda wanted: replace(wanted, state=State.RUNNING))

    def pause(self) -> None:
        """Rest after the iteration under way."""
        self._command(lambda wanted: replace(wanted, state=State.RESTING, steps=0))

    def step(self) -> None:
        """One iteration, then rest."""
        self._command(lambda wanted: replace(wanted, state=State.RESTING, steps=wanted.steps + 1))

    def reset(self) -> None:
        """Back to the random poses, at rest."""
        self._command(lambda wanted: replace(wanted, state=State.RESTING, steps=0, anew=True))

    def change(self, **controls) -> None:
        """Other controls, in force at the next iteration. Raises InputError if they do not fit the pool."""

        def changed(wanted: _Wanted) -> _Wanted:
            now, then = wanted.controls, replace(wanted.controls, **controls)
            self._check(then)
            anew = wanted.anew or (then.count, then.seed) != (now.count, now.seed)
            return replace(wanted, controls=then, anew=anew)

        self._command(changed)

    def wait(self) -> None:
        """Return when it rests. Raises what the run or the watcher has raised."""
        with self._changed:
            self._changed.wait_for(lambda: self._thread is None or self._at_rest())
        if self._error is not None:
            raise self._error

    def _at_rest(self) -> bool:
        return self._waiting and not self._wanted.acts(self._under_way)

    def close(self) -> None:
        """End the thread, and wait for it. The watcher may call it too: then the thread ends after the frame."""
        self._command(lambda wanted: replace(wanted, state=State.CLOSED))
        thread = self._thread
        if thread is not None and thread is not threading.current_thread():
            thread.join()
        atexit.unregister(self.close)  # it would keep the run, and its scenes, until the process ends

    def _command(self, changed: Callable[[_Wanted], _Wanted]) -> None:
        with self._changed:
            if self._wanted.state is not State.CLOSED:  # a closed run stays closed
                self._wanted = changed(self._wanted)
            if self._thread is None and self._error is None and self._wanted.state is not State.CLOSED:
                self._thread = threading.Thread(target=self._work, name="live", daemon=True)
                self._thread.start()
                atexit.register(self.close)
            self._changed.notify_all()

    def _check(self, controls: Controls) -> None:
        if not 1 <= controls.count <= len(self.pool):
            raise InputError(f"count must be 1 to {len(self.pool)}, the size of the pool, got {controls.count}")
        if not 0 < controls.height <= 1:
            raise InputError(f"height must be above 0 and at most 1, got {controls.height}")
        self._in_force(controls)

    # -- the thread --------------------------------------------------------------------------------------------------

    def _work(self) -> None:
        try:
            while self._wanted.state is not State.CLOSED:
                self._arrange_and_rest()
        except BaseException as error:
            self._error = error
        with self._changed:
            self._thread = None
            self._changed.notify_all()

    def _arrange_and_rest(self) -> None:
        """Until other poses or targets are wanted."""
        with self._changed:
            self._under_way, anew = self._wanted.controls, self._wanted.anew
            self._wanted = replace(self._wanted, anew=False)
        self._set_up()
        if anew:
            self._start, self._rows = Poses.random(self._problem.bodies, self.container, self._under_way.seed), []
        self._show(self._start)
        while self._may_go_on():
            settings = self._in_force(self.controls)
            self._last = settings.iterations - 1
            done = optimize(self._problem, settings, self._start, scene=self._scene, callback=self._after)
            self._start = done.poses
            if not done.interrupted:
                self._show(self._start, judged=True)

    def _set_up(self) -> None:
        count = self._under_way.count
        if count not in self._scenes:
            self._scenes[count] = Problem(self.pool[:count], self.container).scene(
                viewing_volume=self.settings.viewing_volume
            )
        self._scene = self._scenes[count]
        targets = self._scene.container_silhouettes(self.settings.resolution, self._under_way.height).numpy()
        self._problem = Problem(self.pool[:count], self.container, self._scene.cameras, targets)

    def _after(self, step: Step) -> Settings | bool:
        """What `optimize` calls after an iteration: a frame if one is due, a rest if one is wanted."""
        self._rows.append(step.losses)
        if step.iteration == self._last:
            return self._come_to_the_end()
        wanted = self._wanted
        resting = wanted.state is State.RESTING and not wanted.steps
        if resting or time.monotonic() - self._shown > EVERY:
            self._show(Poses(step.rotation, step.translation))
        return self._in_force(self.controls) if self._may_go_on() else True

    def _come_to_the_end(self) -> bool:
        """After the last iteration: rest, if nothing else is wanted. What is asked for from here on is done next."""
        with self._changed:
            ends = self._wanted.ends(self._under_way)
            if not ends:
                self._wanted = replace(self._wanted, state=State.RESTING)
            return ends

    def _may_go_on(self) -> bool:
        """Wait for leave to iterate; False where what is under way must end first."""
        with self._changed:
            self._waiting = True
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._wanted.acts(self._under_way))
            self._waiting = False
            if self._wanted.ends(self._under_way):
                return False
            self._wanted = replace(self._wanted, steps=max(0, self._wanted.steps - 1))
            return True

    def _in_force(self, controls: Controls) -> Settings:
        shared = {name: getattr(controls, name) for name in ("weighting", "lambda_", "epsilon", "overlap_term", "seed")}
        return replace(self.settings, **shared)

    def _show(self, start: Poses, judged: bool = False) -> None:
        scene, problem = self._scene, self._problem
        place = start.rotation.float(), start.translation.float()
        images = render(scene.outlines, *place, scene.views, self.settings.resolution)
        taken = query_points.occupancy(scene.stack, scene.half, *place, self._lattice).flatten()
        taken = taken if self._lattice.inside is None else taken[self._lattice.inside]
        matrices = file_to_world(problem.bodies, start.rotation, start.translation)
        history = torch.stack(self._rows).numpy() if self._rows else np.zeros((0, len(LOSS_NAMES)), np.float32)
        filled, shared = (float((taken >= n).float().mean()) for n in (1, 2))
        certificate = certify(problem.bodies, matrices, self.container) if judged else None
        self.watch(Frame(matrices, images.numpy(), problem.targets, history, filled, shared, certificate))
        self._shown = time.monotonic()
