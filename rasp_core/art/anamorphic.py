"""One sculpture of objects, a different picture from each side.

What pictures allow is their visual hull (`ceiling`). Objects in their true size fill it, added one by one
(`greedy_cover`), moved by the paper's losses (`optimizer`), separated by exact booleans (`overlap_removal`), and the
gaps are filled again. What is chosen is how large the pictures are: the smaller, the fewer objects and the harder; the
smallest that comes out well is taken.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..exact.certificate import certify
from ..exact.overlap_removal import REPAIR_TOLERANCE, remove_overlaps
from ..geometry.cameras import Camera
from ..geometry.containers import box
from ..geometry.meshes import Body, unique_names
from ..objective import LOSS_NAMES
from ..optimizer import Arrangement, optimize
from ..poses import Poses, file_to_world
from ..problem import Problem, Settings
from ..silhouettes import render
from ..util.errors import InputError
from ..util.progress import progress_bar
from .ceiling import hull_silhouettes
from .greedy_cover import SETTINGS as COVER
from .greedy_cover import Covering
from .occluders import add_occluders
from .sculpture import Sculpture


@dataclass(frozen=True)
class SculptSettings:
    """widths_diameters : of the pictures, in mean diameters of the objects; painted ones are wider than
    painted_diameters, as small objects can hide what views dispute. good_likeness : intersection over union with the
    ceiling, in the worst view, at which a sculpture is done; hopeful_likeness, at which it is worth optimising.
    largest_count : of objects, if none is given. first_gain_of_dark, last_gain_of_dark : what an object must gain, as a
    fraction of a picture's dark pixels. rounds : of optimising and filling again. largest_fault : of a body's volume,
    overlaps that booleans are asked to remove. good_dispute : mean square error, of colours in [0, 1], that may be left
    to what two views see. coarse_px : pixels looked at as one to decide what hides what."""

    widths_diameters: tuple[float, ...] = (5.0, 6.0, 7.2, 8.6, 10.4, 12.4, 15.0, 18.0, 21.5, 26.0)
    painted_diameters: float = 12.0
    good_likeness: float = 0.97
    hopeful_likeness: float = 0.9
    largest_count: int = 600
    first_gain_of_dark: float = 1e-3
    last_gain_of_dark: float = 2e-4
    rounds: int = 3
    separation_iterations: int = 60
    largest_fault: float = 0.05
    good_dispute: float = 3e-3
    coarse_px: int = 2


SETTINGS = SculptSettings()
OPTIMISATION = Settings(
    iterations=120,
    learning_rate=3e-3,
    final_learning_rate=1.5e-4,
    softness_px=1.5,
    final_softness_px=0.5,
    weighting="printed",
    silhouette_weight=100.0,
    overlap_weight=0.0,
    lambda_=0.0,
    contact_weight=1.0,
    query_points=20_000,
)


@dataclass(frozen=True)
class _Trial:
    """What one width gave: a score, the objects, and the losses of each optimisation."""

    score: float
    width: float
    chosen: list[int]
    poses: Poses
    history: list[np.ndarray]


def sculpt(
    pool: Sequence[Body],
    pictures: np.ndarray,
    cameras: Sequence[Camera],
    *,
    colours: np.ndarray | None = None,
    count: int | None = None,
    width: float | None = None,
    seed: int = 0,
    device="cpu",
    time_limit: float | None = None,
    progress: bool = False,
) -> Sculpture:
    """A sculpture of objects of the pool, each as often as is wanted, that shows `pictures` `(K, H, H)` bool.

    cameras : K, about the origin; of their widths only the proportions count. colours `(K, H, H, 3)` in [0, 1] : of the
    pictures, if the sculpture is to be painted; then objects hide what two views would have to share. count : of
    objects, at most. width : of the smallest picture in metres, searched if None. time_limit : seconds after which no
    further width is begun.

    Raises InputError as `hull_silhouettes` does, for no objects, a count or width that is not positive, colours of
    another shape, and if not one object can be placed.
    """
    began, pictures = time.monotonic(), np.asarray(pictures, bool)
    colours = None if colours is None else np.asarray(colours)
    _check(pool, pictures, colours, count, width)
    least = min((camera.width for camera in cameras), default=1.0)
    cameras = [replace(camera, width=camera.width / least) for camera in cameras]
    hull = hull_silhouettes(pictures, cameras)
    painted, step, best, rounds = colours is not None, SETTINGS.coarse_px, None, []
    # a given number of objects may be too few to cover a wide picture
    widths = [width] if width is not None else _widths(pool, painted and count is None)
    covering, count = Covering(pool, cameras, hull, seed), count or SETTINGS.largest_count
    coarse = Covering(pool, cameras, hull[:, ::step, ::step], seed) if painted else None
    with progress_bar("art", "width", progress, len(widths)) as bar:
        for edge in widths:
            covering.reset(edge)
            history, dispute = _build(covering, count, seed, device), 0.0
            if painted and covering.chosen:
                dispute = _occlude(covering, coarse, colours[:, ::step, ::step], count)
            _remove_overlaps(covering)
            worst, alike = float(covering.likeness.min()), covering.likeness.tolist()
            rounds.append({"width": edge, "objects": len(covering.chosen), "likeness": alike, "dispute": dispute})
            bar.update()
            bar.set_postfix_str(f"{len(covering.chosen)} objects, likeness {worst:.3f}")
            good = SETTINGS.good_likeness
            score = min(worst, good) - dispute / SETTINGS.good_dispute * (1 - good)
            if covering.chosen and (best is None or score > best.score):
                best = _Trial(score, edge, list(covering.chosen), covering.poses, history)
            done = worst >= good and dispute <= SETTINGS.good_dispute
            if done or (time_limit is not None and time.monotonic() - began > time_limit):
                break
    if best is None:
        raise InputError("not one of the objects could be placed; give smaller ones, or a larger width")
    covering.reset(best.width)
    arrangement = _arrangement(covering, best, pictures, seed, device)
    certificate = certify(arrangement.problem.bodies, arrangement.matrices, arrangement.problem.container)
    return Sculpture(arrangement, certificate, pictures, hull, rounds, colours)


def _check(pool: Sequence[Body], pictures: np.ndarray, colours, count: int | None, width: float | None) -> None:
    if not pool:
        raise InputError("there is nothing to arrange; give at least one object")
    if count is not None and count < 1:
        raise InputError(f"a sculpture needs at least one object, got a count of {count}")
    if width is not None and not width > 0:
        raise InputError(f"the pictures' width must be positive, got {width}")
    if colours is not None and np.shape(colours) != (*pictures.shape, 3):
        raise InputError(f"pictures of shape {pictures.shape} need colours (..., 3), got {np.shape(colours)}")


def _widths(pool: Sequence[Body], painted: bool) -> list[float]:
    """Of the pictures, metres."""
    diameter = 2 * float(np.mean([body.radius for body in pool]))
    return [w * diameter for w in SETTINGS.widths_diameters if not painted or w > SETTINGS.painted_diameters]


def _arrangement(covering: Covering, trial: _Trial, pictures: np.ndarray, seed: int, device) -> Arrangement:
    """The trial's objects before the covering's cameras, rendered."""
    bodies = unique_names([covering.pool[i] for i in trial.chosen])
    problem = Problem(bodies, box([trial.width] * 3), covering.cameras, covering.wanted.astype(np.float32))
    scene = problem.scene(device)
    rotation, translation = (x.to(scene.device, scene.dtype) for x in (trial.poses.rotation, trial.poses.translation))
    return Arrangement(
        problem=problem,
        settings=_settings(covering, seed),
        rotation=trial.poses.rotation.double(),
        translation=trial.poses.translation.double(),
        images=render(scene.outlines, rotation, translation, scene.views, covering.size).cpu().numpy(),
        targets=pictures.astype(np.float32),
        cameras=covering.cameras,
        history=np.concatenate([np.zeros((0, len(LOSS_NAMES)), np.float32), *trial.history]),
    )


def _settings(covering: Covering, seed: int) -> Settings:
    margin = COVER.margin_widths * covering.width
    return replace(OPTIMISATION, resolution=covering.size, contact_margin=margin, seed=seed)


def _build(covering: Covering, count: int, seed: int, device) -> list[np.ndarray]:
    """Fill the pictures at the covering's width, optimise, and fill what is left, until that is good; returns the
    losses of each optimisation."""
    dark, history = covering.wanted.sum((1, 2)).mean(), []
    covering.fill(count, SETTINGS.first_gain_of_dark * dark)
    while covering.chosen and covering.likeness.min() > SETTINGS.hopeful_likeness and len(history) < SETTINGS.rounds:
        history.append(_optimize(covering, seed + len(history), device))
        covering.fill(count - len(covering.chosen), SETTINGS.last_gain_of_dark * dark)
        if covering.likeness.min() >= SETTINGS.good_likeness:
            break
    return history


def _occlude(covering: Covering, coarse: Covering, colours: np.ndarray, count: int) -> float:
    """Hide what views dispute behind more objects, decided on fewer pixels, `coarse` with its `colours`; returns the
    mean square error that is left to it."""
    coarse.reset(covering.width)
    coarse.set_bodies(covering.chosen, covering.poses)
    left = add_occluders(coarse, colours, count - len(coarse.chosen))
    covering.set_bodies(coarse.chosen, coarse.poses)
    return left


def _remove_overlaps(covering: Covering) -> None:
    """Remove by exact booleans what overlaps between the samples of `covering`; objects that cannot be separated are
    taken out."""
    room = box([covering.width] * 3)
    while covering.chosen:
        bodies = unique_names([covering.pool[i] for i in covering.chosen])
        start = covering.poses
        matrices = file_to_world(bodies, start.rotation, start.translation)
        certificate = certify(bodies, matrices, room, REPAIR_TOLERANCE)
        if certificate.holds:
            return
        repaired = remove_overlaps(bodies, start, room, REPAIR_TOLERANCE, SETTINGS.largest_fault)
        if repaired is not None:
            covering.set_bodies(covering.chosen, repaired)
            return
        faulty = {fault.second for fault in certificate.overlaps} | {fault.body for fault in certificate.protrusions}
        keep = [k for k, body in enumerate(bodies) if body.name not in faulty]
        covering.set_bodies([covering.chosen[k] for k in keep], start.take(keep))


def _optimize(covering: Covering, seed: int, device) -> np.ndarray:
    """Minimise Eq. 2 and contact, then contact alone; booleans remove what is left. What still overlaps, or is no
    better than before, is forgotten. Returns the losses."""
    chosen, before, alike = list(covering.chosen), covering.poses, covering.likeness.mean()
    bodies, room = [covering.pool[i] for i in chosen], box([covering.width] * 3)
    problem = Problem(bodies, room, covering.cameras, covering.wanted.astype(np.float32))
    settings = _settings(covering, seed)
    scene = problem.scene(device)
    run = optimize(problem, settings, before, device, scene=scene)
    repaired = remove_overlaps(bodies, run.poses, room, REPAIR_TOLERANCE, SETTINGS.largest_fault)
    if repaired is None:
        separating = replace(
            settings,
            silhouette_weight=0.0,
            iterations=SETTINGS.separation_iterations,
            learning_rate=settings.learning_rate / 10,
        )
        separated = optimize(problem, separating, run.poses, device, scene=scene).poses
        repaired = remove_overlaps(bodies, separated, room, REPAIR_TOLERANCE, SETTINGS.largest_fault)
    if repaired is not None:
        covering.set_bodies(chosen, repaired)
    if covering.likeness.mean() < alike:
        covering.set_bodies(chosen, before)
    return run.history
