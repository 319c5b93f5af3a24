"""Broken things put back together: each part where it belongs in the whole, then all refined together.

The whole is a mesh, or only its silhouettes. Then parts are matched to each other within the visual hull, and the
paper's losses, Eq. 2 and 4, decide between the ways to place them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch

from ..exact.certificate import Certificate, certify
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
from .beam_search import best_assembly, possible_assemblies, refine_together
from .holes import Hole
from .scored_poses import ScoredPose, stack, unstack


@dataclass(frozen=True)
class AssemblySettings:
    """What is accepted of parts and warned of, and how silhouettes decide.

    volume_tolerance, largest_volume : how far the parts' volume may be from the whole's without a warning, and from
    where it is an error, as fractions of the whole's; less than least_volume, or as much more, is another unit.
    doubtful_score, doubtful_likeness : under which there is a warning; likeness is intersection over union.
    optimised : ways to place all parts that the paper's losses decide between, with the settings OPTIMISATION.
    """

    volume_tolerance: float = 0.03
    largest_volume: float = 1.2
    least_volume: float = 1e-3
    doubtful_score: float = 0.5
    doubtful_likeness: float = 0.95
    optimised: int = 8


OPTIMISATION = Settings(
    iterations=150,
    learning_rate=4e-3,
    softness_px=2.0,
    final_softness_px=0.5,
    weighting="printed",
    silhouette_weight=100.0,
    lambda_=0.0,
    query_points=20_000,
)
SETTINGS = AssemblySettings()


@dataclass(frozen=True)
class Assembly:
    """Where the parts belong.

    container : the whole, or the visual hull of its silhouettes. poses : of the parts, in the order of `bodies`. scores
    `(N,)`: the fraction of each part's surface that lies on the whole's surface or a neighbour's, the nearer the more,
    less twice the fraction that is where it must not be; in a hull neighbours alone count. warnings : lines of text,
    none if all parts have their places. likeness `(K,)`: intersection over union of the parts' silhouettes with the
    given ones; None if none were given. From the pieces alone, see `pieces_alone`, the container is a box about all
    pieces, scores are of their creases, and holes say where pieces are missing; else holes is None.
    """

    bodies: Sequence[Body]
    container: Container
    poses: Poses
    scores: np.ndarray
    warnings: Sequence[str] = ()
    likeness: np.ndarray | None = None
    holes: Sequence[Hole] | None = None

    @property
    def matrices(self) -> np.ndarray:
        """`(N, 4, 4)` float64: from each file's coordinates to the world."""
        return file_to_world(self.bodies, self.poses.rotation, self.poses.translation)

    @cached_property
    def certificate(self) -> Certificate:
        """What exact booleans say: fractures as scanned or cut overlap a little."""
        return certify(self.bodies, self.matrices, self.container)


def assemble(bodies: Sequence[Body], whole: Container, seed: int = 0, progress: bool = False) -> Assembly:
    """Find the parts' poses in the whole; the poses in which they come are not used.

    Raises InputError for fewer than two parts, for parts of more volume than the whole's, and if one fits nowhere.
    """
    volume = _check_volume(bodies, whole)
    warnings = []
    if abs(volume - 1) > SETTINGS.volume_tolerance:
        warnings.append(f"the parts have {volume:.2f} times the whole's volume; are all there, in the same unit?")
    found = best_assembly(bodies, whole, seed, progress)
    for body, pose in zip(bodies, found, strict=True):
        if pose.score < SETTINGS.doubtful_score:
            warnings.append(f"{body.name} lies doubtfully: {pose.score:.2f} of 1 for its surface")
    return Assembly(list(bodies), whole, _poses(found), np.array([pose.score for pose in found]), warnings)


def assemble_by_silhouettes(
    bodies: Sequence[Body], images: np.ndarray, cameras: Sequence[Camera], seed: int = 0, progress: bool = False
) -> Assembly:
    """Find the parts' poses from silhouettes of the whole alone: `(K, H, H)` in [0, 1], row 0 on top.

    Raises InputError as `assemble` and `visual_hull` do.
    """
    images = np.asarray(images, np.float32)
    hull = Container(visual_hull(images, cameras))
    _check_volume(bodies, hull)
    problem = Problem(bodies, hull, cameras, images)
    scene = problem.scene()
    ways = [_poses(way) for way in possible_assemblies(bodies, hull, seed, progress)]
    ways.sort(key=lambda poses: -_likeness(scene, poses, images).mean())
    settings = replace(OPTIMISATION, resolution=images.shape[-1], seed=seed)
    optimised = optimize_many(problem, ways[: SETTINGS.optimised], settings, scene=scene)
    best = min(optimised, key=lambda arrangement: arrangement.history[-1, 0]).poses
    found = unstack(best.rotation.numpy(), best.translation.numpy(), np.zeros(len(bodies)))
    found = refine_together(bodies, hull, found)
    warnings, alike = [], _likeness(scene, _poses(found), images)
    for camera, share in zip(cameras, alike, strict=True):
        if share < SETTINGS.doubtful_likeness:
            warnings.append(
                f"the parts' silhouette {camera.direction} is like the given one by {share:.1%} only (intersection "
                "over union)"
            )
    return Assembly(list(bodies), hull, _poses(found), np.array([pose.score for pose in found]), warnings, alike)


def _likeness(scene: Scene, poses: Poses, images: np.ndarray) -> np.ndarray:
    """`(K,)` intersection over union of each view's silhouette with the given one."""
    rotation, translation = poses.rotation.float(), poses.translation.float()
    rendered = render(scene.outlines, rotation, translation, scene.views, images.shape[-1]).numpy() > 0.5
    return likeness(rendered, images > 0.5)


def _check_volume(bodies: Sequence[Body], whole: Container) -> float:
    """The parts' volume as a fraction of the whole's."""
    if len(bodies) < 2:
        raise InputError(f"assembly needs at least two parts, got {len(bodies)}")
    volume = sum(body.volume for body in bodies) / whole.volume
    if volume < SETTINGS.least_volume or volume > 1 / SETTINGS.least_volume:
        raise InputError(
            f"the parts' lengths look {volume ** (1 / 3):.2g} times the whole's: together they have {volume:.2g} times "
            "its volume; give both in one unit, at one scale"
        )
    if volume > SETTINGS.largest_volume:
        raise InputError(f"the parts have {volume:.2f} times the whole's volume; are they its parts, in the same unit?")
    return volume


def _poses(found: Sequence[ScoredPose]) -> Poses:
    rotation, translation = stack(found)
    return Poses(torch.from_numpy(rotation), torch.from_numpy(translation))
