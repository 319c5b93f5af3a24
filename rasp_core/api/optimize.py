"""The bare loop, at the door: Eq. 1 over given objects, without a search for which of them fit."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ..exact.certificate import certify
from ..geometry.cameras import Camera
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..iteration import Step
from ..optimizer import optimize as run
from ..poses import Poses
from ..problem import Problem, Settings
from ..util.devices import resolve_device
from ..util.errors import InputError
from .inputs import as_bodies, as_container
from .result import Result


def optimize(
    parts: str | Path | Sequence[Body] | Sequence[str | Path],
    container: str | Path | Container,
    targets: np.ndarray | None = None,
    cameras: Sequence[Camera] | None = None,
    *,
    start: Poses | None = None,
    seed: int = 0,
    device: str = "auto",
    callback: Callable[[Step], object] | None = None,
    progress: bool = False,
    **settings,
) -> Result:
    """Minimise Eq. 1 over the poses of all objects, from random poses, and say what exact booleans find.

    targets : `(K, H, W)` in [0, 1], row 0 on top, for `cameras`; the container's own silhouettes if None.
    start : poses to start from. callback : called after each iteration, see `optimizer.optimize`.
    settings : by the names of `problem.Settings` (iterations, lambda_, epsilon, overlap_term, ...).
    Raises InputError for settings out of range, and for targets that do not fit the cameras.

    >>> import rasp_core as rasp
    >>> from data_fetch import kitchen_like
    >>> run = rasp.optimize(kitchen_like(3), rasp.box(0.3, 0.3, 0.3), iterations=20, resolution=64)
    >>> run.history.shape, run.matrices.shape
    ((20, 5), (3, 4, 4))
    """
    began = time.monotonic()
    bodies, room = as_bodies(parts), as_container(container)
    if not isinstance(room, Container):
        raise InputError("the loop needs a container that is given; use rasp.pack for a box to be found")
    try:
        chosen = Settings(seed=seed, **settings)
    except TypeError as error:
        raise InputError(f"optimize: {error}; see problem.Settings for the names") from error
    problem = Problem(bodies, room, cameras, targets)
    arrangement = run(problem, chosen, start, resolve_device(device), callback=callback, progress=progress)
    certificate = certify(bodies, arrangement.matrices, room)
    return Result(arrangement, certificate, time.monotonic() - began)
