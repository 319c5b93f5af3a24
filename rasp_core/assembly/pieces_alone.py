"""Broken things put back together from their pieces alone: nothing is known of the whole."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from tqdm.auto import tqdm

from ..geometry import containers
from ..geometry.meshes import Body
from ..poses import Poses
from ..util.errors import InputError
from .assemble import Assembly
from .holes import Hole, find_holes
from .piece_growing import Growing
from .scored_poses import ScoredPose

MARGIN = 1.02  # edges of the box about all pieces, over theirs
ASIDE = 0.1  # of the largest piece's radius: the gap between the assembly and pieces that belong to nothing


def assemble_alone(bodies: Sequence[Body], seed: int = 0, progress: bool = False) -> Assembly:
    """Find how pieces lie to each other; the poses in which they come are not used.

    The piece of the largest volume keeps the orientation of its file. Pieces that fit no other one are put beside the
    assembly, with a score of 0 and a warning. The container is a box about all pieces, its centre the world's origin:
    the certificate says what overlaps, and nothing sticks out. A hole is no warning: on a thing whose handle is as thin
    as its wall, the handle may be taken for one.

    Raises InputError for fewer than two pieces, and if no two fit each other.
    """
    if len(bodies) < 2:
        raise InputError(f"assembly needs at least two parts, got {len(bodies)}")
    with tqdm(total=len(bodies) * (len(bodies) - 1) // 2, disable=not progress, desc="match", leave=False) as bar:
        growing = Growing(bodies, seed, bar)
    grown = growing.grow()
    if not grown.poses:
        raise InputError(
            f"no two of the {len(bodies)} pieces fit each other; are they pieces of one thing, in one unit? --whole or "
            "--silhouettes may help"
        )
    grown = growing.without_foreign(growing.refined(growing.add_missing(grown)))
    poses = _set_up(bodies, grown.poses)
    placed = sorted(grown.poses)
    holes = find_holes([growing.pieces[k] for k in placed], [poses[k] for k in placed])
    rotation = np.stack([pose.rotation for pose in poses])
    translation = np.stack([pose.translation for pose in poses])
    corners = _corners(bodies, rotation, translation)
    low, high = corners.min(0), corners.max(0)
    middle = (low + high) / 2
    warnings = [
        f"{body.name} belongs to none of the others; it lies beside them"
        for k, body in enumerate(bodies)
        if k not in grown.poses
    ]
    scores = [
        grown.poses[k].score / max(len(piece.creases.points), 1) if k in grown.poses else 0.0
        for k, piece in enumerate(growing.pieces)
    ]
    return Assembly(
        bodies=list(bodies),
        container=containers.box(MARGIN * (high - low)),
        poses=Poses(torch.from_numpy(rotation), torch.from_numpy(translation - middle)),
        scores=np.clip(scores, 0, 1),
        warnings=warnings,
        holes=[Hole(hole.centre - middle, hole.area) for hole in holes],
    )


def _set_up(bodies: Sequence[Body], poses: dict[int, ScoredPose]) -> list[ScoredPose]:
    """Poses of all bodies: the largest placed one as in its file, those that are not placed in a row beside them."""
    largest = max(poses, key=lambda k: bodies[k].volume)
    turn, shift = poses[largest].rotation.T, poses[largest].translation
    placed = {k: ScoredPose(turn @ p.rotation, turn @ (p.translation - shift), p.score) for k, p in poses.items()}
    stacked = [np.stack([getattr(placed[k], name) for k in placed]) for name in ("rotation", "translation")]
    edge = _corners([bodies[k] for k in placed], *stacked)[:, 0].max()
    for k, body in enumerate(bodies):
        if k not in placed:
            edge += ASIDE * bodies[largest].radius + body.half_extents[0]
            placed[k] = ScoredPose(np.eye(3), np.array([edge, 0.0, 0.0]))
            edge += body.half_extents[0]
    return [placed[k] for k in range(len(bodies))]


def _corners(bodies: Sequence[Body], rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
    """All vertices where the poses put them."""
    rows = zip(bodies, rotation, translation, strict=True)
    return np.concatenate([body.solid_vertices @ turn.T + shift for body, turn, shift in rows])
