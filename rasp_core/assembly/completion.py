"""An assembly to which pieces are added, one by one, each where it gains most.

What a piece gains is counted in crease points. Each counts once, however many pieces have a crease there: a wrong
assembly often lays three creases on each other. A ledge, where a face ends on the middle of another piece's face,
counts against it, unless a further piece closes it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from . import crease_matching
from .joints import LEDGE, Fits, Joints
from .scored_poses import ScoredPose, stack


@dataclass(frozen=True)
class Growth:
    """Pieces that belong together: poses by their numbers, and how many crease points coincide, less the penalties."""

    poses: Mapping[int, ScoredPose]
    score: float


@dataclass(frozen=True)
class Options:
    """Poses of a piece that is not placed, `(B, 3, 3)`, `(B, 3)`; its joints with each placed one; luck `(B,)`: factors
    of the gains."""

    rotation: np.ndarray
    translation: np.ndarray
    joints: Mapping[int, Joints]
    luck: np.ndarray

    def taken(self, rows: np.ndarray) -> Options:
        """Some of them."""
        joints = {i: joint.taken(rows) for i, joint in self.joints.items()}
        return Options(self.rotation[rows], self.translation[rows], joints, self.luck[rows])

    def joined(self, more: Options) -> Options:
        """These, then more."""
        if not len(self.luck):
            return more
        joints = {i: joint.joined(more.joints[i]) for i, joint in self.joints.items()}
        arrays = (np.concatenate([getattr(self, name), getattr(more, name)]) for name in ("rotation", "translation"))
        return Options(*arrays, joints, np.concatenate([self.luck, more.luck]))

    def distinct(self, angle_rad: float, distance: float, count: int) -> Options:
        """The first ones that are not the same as an earlier one, `count` at most; see `scored_poses.distinct`."""
        from ..kernels.distinct import distinct

        return self.taken(distinct(self.rotation, self.translation, np.cos(angle_rad), distance, count))


class Completion:
    """Placed pieces: their poses, which of their crease points coincide with others', and what else counts."""

    def __init__(self, fits: Fits, poses: Mapping[int, ScoredPose]):
        self.fits, self.poses, self.rest = fits, {}, 0.0
        self.met = [np.zeros(len(piece.creases.points), np.float32) for piece in fits.pieces]
        self.marks = [np.zeros(len(piece.creases.points), np.uint8) for piece in fits.pieces]
        for j, pose in poses.items():
            self.add(j, pose, self.joints(j, *stack([pose])))

    @property
    def growth(self) -> Growth:
        """What is placed, and its score; a piece's own score is how many of its crease points coincide."""
        poses = {j: replace(pose, score=float(self.met[j].sum())) for j, pose in self.poses.items()}
        ledges = sum(float(LEDGE[marks].sum()) for marks in self.marks)
        met = sum(float(met.sum()) for met in self.met) / 2
        return Growth(poses, met + self.rest - crease_matching.SETTINGS.ledge * ledges)

    def joints(
        self, j: int, rotation: np.ndarray, translation: np.ndarray, pieces: Sequence[int] | None = None
    ) -> dict[int, Joints]:
        """Of piece j under poses `(B, 3, 3)`, `(B, 3)`, with placed pieces, by default all."""
        found = {}
        for i in self.poses if pieces is None else pieces:
            turn, there = self.poses[i].rotation, self.poses[i].translation
            found[i] = self.fits.between(i, j, turn.T @ rotation, (translation - there) @ turn)
        return found

    def gains(self, j: int, joints: Mapping[int, Joints]) -> np.ndarray:
        """`(B,)`: what piece j adds to the score, ledges counting little, as further pieces may close them."""
        own, marks, gained, ledges = 0, 0, 0.0, 0.0
        for i, joint in joints.items():
            own, marks = np.maximum(own, joint.own), marks | joint.own_marks
            gained = gained + np.maximum(joint.other - self.met[i], 0).sum(1) / 2 + joint.rest
            ledges = ledges + (LEDGE[self.marks[i] | joint.other_marks] - LEDGE[self.marks[i]]).sum(1)
        return own.sum(1) / 2 + gained - crease_matching.SETTINGS.early_ledge * (ledges + LEDGE[marks].sum(1))

    def add(self, j: int, pose: ScoredPose, joints: Mapping[int, Joints]) -> None:
        """Place a piece of which the joints, under this pose alone, are known."""
        for i, joint in joints.items():
            for k, met, marks in ((j, joint.own, joint.own_marks), (i, joint.other, joint.other_marks)):
                self.met[k] = np.maximum(self.met[k], met[0])
                self.marks[k] = self.marks[k] | marks[0]
            self.rest += float(joint.rest[0])
        self.poses[j] = pose
