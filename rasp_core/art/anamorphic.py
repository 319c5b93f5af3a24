"""One heap of objects, a different picture from each side.

What pictures allow is their visual hull: its own silhouettes are the ceiling of any heap's. Objects in their true size
fill them, put one by one (`covering`), drawn in by the paper's losses (`arrange`), parted by exact booleans
(`mending`), and the gaps filled again. What is chosen is how large the pictures are: the smaller, the fewer objects
and the harder; the smallest that comes out well is taken.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..exact.certificate import Certificate, certify
from ..exact.overlap_removal import REPAIR_TOLERANCE, remove_overlaps
from ..exact.visual_hull import visual_hull
from ..geometry.cameras import Camera
from ..geometry.containers import box
from ..geometry.meshes import Body, unique_names
from ..geometry.silhouette_edges import Views
from ..objective import LOSS_NAMES
from ..optimizer import Arrangement, optimize
from ..poses import file_to_world
from ..problem import Problem, Settings
from ..silhouettes import likeness, render, render_at_rest
from ..util.errors import InputError
from ..util.progress import progress_bar
from .greedy_cover import MARGIN, Covering
from .occluders import veil

WIDTHS = (5.0, 6.0, 7.2, 8.6, 10.4, 12.4, 15.0, 18.0, 21.5, 26.0)  # of the pictures, in mean diameters of the objects
GOOD = 0.97  # intersection over union with the ceiling, in the worst view, at which a heap is done
HOPEFUL = 0.9  # at which it is worth drawing in
MOST = 600  # objects, where no number is given
LEAST = (1e-3, 2e-4)  # of a picture's dark pixels: what an object must gain, at first and at last
ROUNDS = 3  # of drawing in and filling anew
DRAWING = Settings(
    iterations=120,
    learning_rate=3e-3,
    final_learning_rate=1.5e-4,
    softness_px=1.5,
    final_softness_px=0.5,
    silhouette_weight=100.0,
    overlap_weight=0.0,
    lambda_=0.0,
    contact_weight=1.0,
    query_points=20_000,
)
LARGEST_FAULT = 0.05  # of a body's volume: overlaps that booleans are asked to part
PAINTED = 12.0  # mean diameters, at least, of pictures that are painted: small objects can hide what views dispute
DISPUTED = 3e-3  # mean square error, of colours in [0, 1], that a heap may leave to what two views see
COARSE = 2  # pixels looked at as one where it is decided what hides what
ALIKE = 0.95  # intersection over union of the ceiling under which pictures are said to disagree


@dataclass(frozen=True)
class Art:
    """A heap and its pictures.

    arrangement, certificate : objects in a cube, the viewing volume. pictures `(K, H, H)` bool: what was asked for;
    hull `(K, H, H)` bool: the silhouettes of the pictures' visual hull. rounds : what each width gave.
    """

    arrangement: Arrangement
    certificate: Certificate
    pictures: np.ndarray
    hull: np.ndarray
    rounds: Sequence[dict]

    @property
    def likeness(self) -> np.ndarray:
        """`(K,)` intersection over union with the pictures."""
        return likeness(self.arrangement.images > 0.5, self.pictures)

    @property
    def ceiling(self) -> np.ndarray:
        """`(K,)` the hull's intersection over union with the pictures."""
        return likeness(self.hull, self.pictures)

    @property
    def of_ceiling(self) -> np.ndarray:
        """`(K,)` intersection over union with the hull's silhouettes."""
        return likeness(self.arrangement.images > 0.5, self.hull)

    @property
    def shown(self) -> Arrangement:
        """The arrangement beside the pictures that were asked for, rather than the hull's silhouettes."""
        return replace(self.arrangement, targets=self.pictures.astype(np.float32))

    def to_dict(self) -> dict:
        """What result.json says of it, as plain numbers."""
        measures = {"likeness": self.likeness, "ceiling": self.ceiling, "likeness_of_ceiling": self.of_ceiling}
        return {**{name: values.tolist() for name, values in measures.items()}, "rounds": list(self.rounds)}


def ceiling(pictures: np.ndarray, cameras: Sequence[Camera]) -> np.ndarray:
    """`(K, H, H)` bool: the silhouettes of the visual hull of `pictures` `(K, H, H)` bool. Raises InputError as
    `hulls.visual_hull` does, and for fewer than two views or more than four."""
    if not 2 <= len(pictures) <= 4:
        raise InputError(f"art has two to four views, got {len(pictures)}")
    hull = visual_hull(np.asarray(pictures, float), cameras)
    return render_at_rest(hull, Views(cameras), pictures.shape[-1]).numpy() > 0.5


def disagreements(pictures: np.ndarray, hull: np.ndarray, cameras: Sequence[Camera]) -> list[str]:
    """A line for each picture that its ceiling falls short of, with the rows that another leaves empty."""
    lines = []
    for k, best in enumerate(likeness(hull, pictures)):
        if best >= ALIKE:
            continue
        line = f"the picture {cameras[k].direction} can be met to {best:.1%} at most"
        for other, picture in enumerate(pictures):
            level = cameras[k].elevation_deg == cameras[other].elevation_deg == 0
            rows = np.flatnonzero(pictures[k].any(1) & ~picture.any(1)) if level else []
            if len(rows):
                line += f"; {len(rows)} of its rows are empty in the one {cameras[other].direction}"
        lines.append(f"{line}; choose pictures that agree better")
    return lines


def sculpt(
    pool: Sequence[Body],
    pictures: np.ndarray,
    cameras: Sequence[Camera],
    count: int | None = None,
    width: float | None = None,
    seed: int = 0,
    device="cpu",
    time_limit: float | None = None,
    progress: bool = False,
    colours: np.ndarray | None = None,
) -> Art:
    """A heap of objects of the pool, each as often as is wanted, that shows `pictures` `(K, H, H)` bool to `cameras`.

    cameras : about the origin; their width does not count. count : of objects, at most. width : of the pictures in
    metres, chosen where None. time_limit : seconds after which no further width is begun. colours `(K, H, H, 3)` in [0,
    1] : of the pictures, where the heap is to be painted; then objects hide what two views would have to share. Raises
    InputError as `ceiling` does, for no objects, and where not one finds a place.
    """
    if not pool:
        raise InputError("there is nothing to arrange; give at least one object")
    began, pictures = time.monotonic(), np.asarray(pictures, bool)
    cameras = [replace(camera, width=1.0) for camera in cameras]
    hull = ceiling(pictures, cameras)
    covering, best, rounds = Covering(pool, cameras, hull, seed), None, []
    if colours is not None:
        coarse = Covering(pool, cameras, hull[:, ::COARSE, ::COARSE], seed)
        colours = colours[:, ::COARSE, ::COARSE]
    diameter = 2 * float(np.mean([body.radius for body in pool]))
    shares = [share for share in WIDTHS if colours is None or share > PAINTED]
    widths = [width] if width is not None else [share * diameter for share in shares]
    with progress_bar("art", "width", progress, len(widths)) as bar:
        for edge in widths:
            covering.begin(edge)
            history = _build(covering, count or MOST, seed, device)
            left = 0.0 if colours is None or not covering.chosen else _veil(covering, coarse, colours, count or MOST)
            _free(covering)
            worst, alike = float(covering.likeness.min()), covering.likeness.tolist()
            rounds.append({"width": edge, "objects": len(covering.chosen), "likeness": alike, "dispute": left})
            bar.update()
            bar.set_postfix_str(f"{len(covering.chosen)} objects, likeness {worst:.3f}")
            score = min(worst, GOOD) - left / DISPUTED * (1 - GOOD)
            if covering.chosen and (best is None or score > best[0]):
                best = score, edge, list(covering.chosen), covering.start, history
            done = worst >= GOOD and left <= DISPUTED
            if done or (time_limit is not None and time.monotonic() - began > time_limit):
                break
    if best is None:
        raise InputError("not one of the objects could be placed; give smaller ones, or a larger --width")
    _, edge, chosen, start, history = best
    covering.begin(edge)
    bodies = unique_names([pool[i] for i in chosen])
    problem = Problem(bodies, box([edge] * 3), covering.cameras, hull.astype(np.float32))
    scene = problem.scene(device)
    place = (x.to(scene.device, scene.dtype) for x in (start.rotation, start.translation))
    images = render(scene.outlines, *place, scene.views, covering.size).cpu().numpy()
    settings = replace(DRAWING, resolution=covering.size, contact_margin=MARGIN * edge, seed=seed)
    past = np.concatenate([np.zeros((0, len(LOSS_NAMES)), np.float32), *history])
    poses = start.rotation.double(), start.translation.double()
    arrangement = Arrangement(problem, settings, *poses, images, problem.targets, covering.cameras, past)
    return Art(arrangement, certify(bodies, arrangement.matrices, problem.container), pictures, hull, rounds)


def _build(covering: Covering, count: int, seed: int, device) -> list[np.ndarray]:
    """Fill the pictures at the covering's width, draw in, and fill what is left, until that is good; returns the losses
    of each drawing in."""
    area, history = covering.wanted.sum((1, 2)).mean(), []
    covering.fill(count, LEAST[0] * area)
    while covering.chosen and covering.likeness.min() > HOPEFUL and len(history) < ROUNDS:
        history.append(_draw_in(covering, seed + len(history), device))
        covering.fill(count - len(covering.chosen), LEAST[1] * area)
        if covering.likeness.min() >= GOOD:
            break
    return history


def _veil(covering: Covering, coarse: Covering, colours: np.ndarray, count: int) -> float:
    """Hide what views dispute behind objects more, decided on fewer pixels, `coarse` with its `colours`; returns the
    mean square error that is left to it."""
    coarse.begin(covering.width)
    coarse.take(covering.chosen, covering.start)
    left = veil(coarse, colours, count - len(coarse.chosen))
    covering.take(coarse.chosen, coarse.start)
    return left


def _free(covering: Covering) -> None:
    """Part by exact booleans what overlaps between the samples of `covering`; what cannot be parted is taken out."""
    room = box([covering.width] * 3)
    while covering.chosen:
        bodies = unique_names([covering.pool[i] for i in covering.chosen])
        start = covering.start
        matrices = file_to_world(bodies, start.rotation, start.translation)
        certificate = certify(bodies, matrices, room, REPAIR_TOLERANCE)
        if certificate.holds:
            return
        mended = remove_overlaps(bodies, start, room, REPAIR_TOLERANCE, LARGEST_FAULT)
        if mended is not None:
            covering.take(covering.chosen, mended)
            return
        faulty = {fault.second for fault in certificate.overlaps} | {fault.body for fault in certificate.protrusions}
        keep = [k for k, body in enumerate(bodies) if body.name not in faulty]
        covering.take([covering.chosen[k] for k in keep], start.take(keep))


def _draw_in(covering: Covering, seed: int, device) -> np.ndarray:
    """Minimise Eq. 2 and contact, then contact alone; booleans part what is left. What does not come to be free of
    overlap, or is no better, is forgotten. Returns the losses."""
    chosen, before, alike = list(covering.chosen), covering.start, covering.likeness.mean()
    bodies, room = [covering.pool[i] for i in chosen], box([covering.width] * 3)
    problem = Problem(bodies, room, covering.cameras, covering.wanted.astype(np.float32))
    settings = replace(DRAWING, resolution=covering.size, contact_margin=MARGIN * covering.width, seed=seed)
    scene = problem.scene(device)
    run = optimize(problem, settings, before, device, scene=scene)
    mended = remove_overlaps(bodies, run.poses, room, REPAIR_TOLERANCE, LARGEST_FAULT)
    if mended is None:
        parting = replace(settings, silhouette_weight=0.0, iterations=60, learning_rate=settings.learning_rate / 10)
        parted = optimize(problem, parting, run.poses, device, scene=scene).poses
        mended = remove_overlaps(bodies, parted, room, REPAIR_TOLERANCE, LARGEST_FAULT)
    if mended is not None:
        covering.take(chosen, mended)
    if covering.likeness.mean() < alike:
        covering.take(chosen, before)
    return run.history
