"""An arrangement on its own thread, to be watched, paused and changed while it runs: what the sliders drive."""

from __future__ import annotations

import atexit
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from .. import losses, query_points
from ..exact.certificate import Certificate, certify
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..objective import LOSS_NAMES
from ..optimizer import Step, optimize
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

    lambda_, epsilon, overlap_term : as in `Settings`, from the next iteration on. count : how many objects of the pool,
    seed : of their random poses; a change of either starts anew. height : the target silhouettes are those of the
    container squeezed upon its floor to this share of its height; the poses stay.
    """

    lambda_: float = 3.0
    epsilon: float = losses.EPSILON
    overlap_term: str = "shared"
    count: int = 20
    seed: int = 0
    height: float = 1.0


@dataclass(frozen=True)
class Frame:
    """What there is to see after an iteration.

    matrices `(N, 4, 4)`: from the files of the first N bodies to the world. images, targets `(K, H, W)`. history: one
    row an iteration, columns `arrange.LOSS_NAMES`. density, overlap : share of the container that bodies fill, and that
    two or more do, by lattice points. certificate : of exact booleans, where all iterations are done, else None.
    """

    matrices: np.ndarray
    images: np.ndarray
    targets: np.ndarray
    history: np.ndarray
    density: float
    overlap: float
    certificate: Certificate | None


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
        self.controls = controls or Controls(count=min(Controls.count, len(self.pool)))
        self._check(self.controls)
        self._changed = threading.Condition()
        self._going, self._steps, self._anew, self._closed = False, 0, True, False
        self._waiting, self._error = False, None
        self._thread: threading.Thread | None = None
        self._scenes: dict[int, Scene] = {}
        self._lattice = query_points.query_lattice(container, POINTS)
        self._rows: list[Tensor] = []

    # -- commands, from any thread -----------------------------------------------------------------------------------

    def run(self) -> None:
        """Go on until `pause`, or the settings' iterations are done."""
        self._command(going=True)

    def pause(self) -> None:
        """Rest after the iteration under way."""
        self._command(going=False, steps=0)

    def step(self) -> None:
        """One iteration, then rest."""
        self._command(going=False, steps=self._steps + 1)

    def reset(self) -> None:
        """Back to the random poses, at rest."""
        self._command(going=False, steps=0, anew=True)

    def change(self, **controls) -> None:
        """Other controls, in force at the next iteration. Raises InputError where they do not fit the pool."""
        wanted, now = replace(self.controls, **controls), self.controls
        self._check(wanted)
        self.controls = wanted
        self._command(anew=self._anew or (wanted.count, wanted.seed) != (now.count, now.seed))

    def wait(self) -> None:
        """Return when it rests. Raises what the run or the watcher has raised."""
        with self._changed:
            self._changed.wait_for(lambda: self._thread is None or (self._waiting and not self._wanted()))
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """End the thread, and wait for it."""
        self._command(closed=True)
        thread = self._thread
        if thread is not None:
            thread.join()

    def _command(self, **states) -> None:
        with self._changed:
            for name, value in states.items():
                setattr(self, f"_{name}", value)
            if self._thread is None and self._error is None and not self._closed:
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
            while not self._closed:
                self._arrange_and_rest()
        except BaseException as error:
            self._error = error
        with self._changed:
            self._thread = None
            self._changed.notify_all()

    def _arrange_and_rest(self) -> None:
        """Until other poses or targets are wanted."""
        with self._changed:
            self._under_way, anew, self._anew = self.controls, self._anew, False
        self._set_up()
        if anew:
            self._start, self._rows = Poses.random(self._problem.bodies, self.container, self._under_way.seed), []
        self._show(self._start)
        while self._may_go_on():
            settings = self._in_force(self.controls)
            done = optimize(self._problem, settings, self._start, scene=self._scene, callback=self._after)
            self._start = done.poses
            if not done.interrupted:
                with self._changed:
                    self._going, self._steps = False, 0
                self._show(self._start, judged=True)

    def _set_up(self) -> None:
        count = self._under_way.count
        if count not in self._scenes:
            self._scenes[count] = Problem(self.pool[:count], self.container).scene()
        self._scene = self._scenes[count]
        targets = self._scene.container_silhouettes(self.settings.resolution, self._under_way.height).numpy()
        self._problem = Problem(self.pool[:count], self.container, self._scene.cameras, targets)

    def _after(self, step: Step) -> Settings | bool:
        """What `arrange` calls after an iteration: a frame where one is due, a rest where one is wanted."""
        self._rows.append(step.losses)
        resting = not self._going and not self._steps
        if resting or time.monotonic() - self._shown > EVERY:
            self._show(Poses(step.rotation, step.translation))
        return self._in_force(self.controls) if self._may_go_on() else True

    def _may_go_on(self) -> bool:
        """Wait for leave to iterate; False where what is under way must end first."""
        with self._changed:
            self._waiting = True
            self._changed.notify_all()
            self._changed.wait_for(self._wanted)
            self._waiting = False
            if self._ends():
                return False
            self._steps = max(0, self._steps - 1)
            return True

    def _wanted(self) -> bool:
        """Whether there is something to do."""
        return self._going or self._steps > 0 or self._ends()

    def _ends(self) -> bool:
        return self._closed or self._anew or self.controls.height != self._under_way.height

    def _in_force(self, controls: Controls) -> Settings:
        shared = {name: getattr(controls, name) for name in ("lambda_", "epsilon", "overlap_term", "seed")}
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
