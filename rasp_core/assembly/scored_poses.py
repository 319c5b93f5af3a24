"""Poses of one part, how good each is, and which of them are the same."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class ScoredPose:
    """rotation `(3, 3)`, translation `(3,)` of the part's centre, metres; score, the larger the better, 1 at most."""

    rotation: np.ndarray
    translation: np.ndarray
    score: float = 0.0

    def differs(self, other: ScoredPose, angle_rad: float, distance: float) -> bool:
        """Whether the two are more than an angle, or a distance in metres, apart."""
        cosine = (np.sum(self.rotation * other.rotation) - 1) / 2
        return bool(cosine < np.cos(angle_rad) or np.linalg.norm(self.translation - other.translation) > distance)


def stack(poses: Sequence[ScoredPose]) -> tuple[np.ndarray, np.ndarray]:
    """Rotations `(B, 3, 3)` and translations `(B, 3)`."""
    rotation, translation = [pose.rotation for pose in poses], [pose.translation for pose in poses]
    return np.array(rotation).reshape(-1, 3, 3), np.array(translation).reshape(-1, 3)


def unstack(rotation: np.ndarray, translation: np.ndarray, scores: np.ndarray) -> list[ScoredPose]:
    """The poses of `(B, 3, 3)`, `(B, 3)` and `(B,)`."""
    return [ScoredPose(*row) for row in zip(rotation, translation, scores.tolist(), strict=True)]


def best_first(poses: Iterable[ScoredPose]) -> list[ScoredPose]:
    """Sorted by score; of equal ones the first stays first."""
    return sorted(poses, key=lambda pose: -pose.score)


def distinct(poses: Sequence[ScoredPose], count: int, angle_rad: float, distance: float) -> list[ScoredPose]:
    """The first ones that are not the same as an earlier one, `count` at most; see `ScoredPose.differs`."""
    from ..kernels import distinct as kernels

    kept = kernels.distinct(*stack(poses), np.cos(angle_rad), distance, count)
    return [poses[k] for k in kept]
