"""Broken things put back together: each part where it belongs in the whole, then all drawn together.

The whole is a mesh, or only its silhouettes: then parts are sought in their visual hull, and the paper's losses, Eq. 2
and 4, draw them together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from ..exact.visual_hull import visual_hull
from ..geometry.cameras import Camera
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..optimizer import optimize_many
from ..poses import Poses, file_to_world
from ..problem import Problem, Settings
from ..scene import Scene
from ..silhouettes import likeness, render
from ..util.errors import InputError
from .beam_search import candidates, draw_together, solve
from .registration import Place

SPARE = 0.03  # share of the whole's volume by which the parts may miss it without a word
MOST = 1.2  # of the whole's volume: parts that have more are not its parts
DRAWN = 8  # ways to place all parts in a hull that the paper's losses decide between
DRAWING = Settings(
    iterations=150,
    learning_rate=4e-3,
    softness_px=2.0,
    final_softness_px=0.5,
    silhouette_weight=100.0,
    lambda_=0.0,
    query_points=20_000,
)
POOR = 0.5  # score under which a part's place is doubtful
UNLIKE = 0.95  # intersection over union of a silhouette under which it is doubtful


@dataclass(frozen=True)
class Assembly:
    """Where the parts belong.

    whole : the whole, or the visual hull of its silhouettes. start : their poses, in the order of `bodies`. scores
    `(N,)`: how much of each part's surface lies on the whole's surface or on a neighbour's, the more the nearer, less
    twice the share that is where it must not be; in a hull neighbours alone count. warnings : lines of text, none
    where all parts have their places. likeness `(K,)`: intersection over union of the parts' silhouettes with the given
    ones; None where the whole's mesh was given.
    """

    bodies: Sequence[Body]
    whole: Container
    start: Poses
    scores: np.ndarray
    warnings: Sequence[str] = ()
    likeness: np.ndarray | None = None

    @property
    def matrices(self) -> np.ndarray:
        """`(N, 4, 4)` float64: from each file's coordinates to the world."""
        return file_to_world(self.bodies, self.start.rotation, self.start.translation)


def assemble(bodies: Sequence[Body], whole: Container, seed: int = 0, progress: bool = False) -> Assembly:
    """Find the parts' places in the whole; their own poses are not looked at.

    Raises InputError for fewer than two parts, for parts of more volume than the whole's, and where one fits nowhere.
    """
    share = _share(bodies, whole)
    warnings = []
    if abs(share - 1) > SPARE:
        warnings.append(f"the parts have {share:.2f} times the whole's volume; are all there, in the same unit?")
    found = solve(bodies, whole, seed, progress)
    for body, place in zip(bodies, found, strict=True):
        if place.score < POOR:
            warnings.append(f"{body.name} lies doubtfully: {place.score:.2f} of 1 for its surface")
    return Assembly(list(bodies), whole, _start(found), np.array([place.score for place in found]), warnings)


def assemble_by_silhouettes(
    bodies: Sequence[Body], images: np.ndarray, cameras: Sequence[Camera], seed: int = 0, progress: bool = False
) -> Assembly:
    """Find the parts' places from silhouettes of the whole alone: `(K, H, H)` in [0, 1], row 0 on top.

    Raises InputError as `assemble` and `hulls.visual_hull` do.
    """
    images = np.asarray(images, np.float32)
    hull = Container(visual_hull(images, cameras))
    _share(bodies, hull)
    problem = Problem(bodies, hull, cameras, images)
    scene = problem.scene()
    ways = [_start(places) for places in candidates(bodies, hull, seed, progress)]
    ways.sort(key=lambda start: -_alike(scene, start, images).mean())
    drawn = optimize_many(problem, ways[:DRAWN], replace(DRAWING, resolution=images.shape[-1], seed=seed), scene=scene)
    best = min(drawn, key=lambda arrangement: arrangement.history[-1, 0]).poses
    placed = [Place(*pose, 0.0) for pose in zip(best.rotation.numpy(), best.translation.numpy(), strict=True)]
    placed = draw_together(bodies, hull, placed)
    warnings, alikes = [], _alike(scene, _start(placed), images)
    for camera, alike in zip(cameras, alikes, strict=True):
        if alike < UNLIKE:
            warnings.append(
                f"the parts' silhouette {camera.direction} is like the given one by {alike:.1%} only (intersection "
                "over union)"
            )
    scores = np.array([place.score for place in placed])
    return Assembly(list(bodies), hull, _start(placed), scores, warnings, alikes)


def _alike(scene: Scene, start: Poses, images: np.ndarray) -> np.ndarray:
    """Intersection over union of each view's silhouette with the given one."""
    place = start.rotation.float(), start.translation.float()
    drawn = render(scene.outlines, *place, scene.views, images.shape[-1]).numpy() > 0.5
    return likeness(drawn, images > 0.5)


def _share(bodies: Sequence[Body], whole: Container) -> float:
    if len(bodies) < 2:
        raise InputError(f"assembly needs at least two parts, got {len(bodies)}")
    share = sum(body.volume for body in bodies) / whole.volume
    if share > MOST:
        raise InputError(f"the parts have {share:.2f} times the whole's volume; are they its parts, in the same unit?")
    return share


def _start(found: Sequence[Place]) -> Poses:
    rotation, centre = np.stack([place.rotation for place in found]), np.stack([place.centre for place in found])
    return Poses(torch.from_numpy(rotation), torch.from_numpy(centre))
