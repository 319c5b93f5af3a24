"""Moves that a tight packing wants: two objects change places, or one turns where it is.

An object that takes another's position takes its bearing too, principal axis along principal axis: cans stay aligned
with what is about them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from ..geometry.meshes import Body


@dataclass(frozen=True)
class MoveTuning:
    """What moves were tuned to."""

    swap_fraction: float = 0.7  # of the moves, in which two change places
    log_volume_spread: float = 0.35  # two whose logarithms of volume differ so much change places e times less often
    by_energy_fraction: float = 0.8  # of the moves, that begin with a body chosen by its part of the energy
    exchanged_axes_fraction: float = 0.3  # of the objects that change places, two of whose axes are exchanged


TUNING = MoveTuning()
FLIPS = np.array([np.diag(signs) for signs in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))], float)
EXCHANGES = np.array([[[0, 1, 0], [-1, 0, 0], [0, 0, 1]], [[1, 0, 0], [0, 0, 1], [0, -1, 0]]], float)


class Moves:
    """Moves among these bodies, drawn from `random`."""

    def __init__(self, bodies: Sequence[Body], random: np.random.Generator):
        self.random = random
        known = {body.digest: _principal_axes(body) for body in bodies}
        self.axes = np.array([known[body.digest] for body in bodies])
        volume, kind = np.log([body.volume for body in bodies]), np.array([body.digest for body in bodies])
        self.likely = np.exp(-np.abs(volume[:, None] - volume) / TUNING.log_volume_spread) * (kind[:, None] != kind)

    def any(
        self, rotation: np.ndarray, translation: np.ndarray, energy_of_body: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Poses after a move: rotation `(N, 3, 3)`, translation `(N, 3)`; those given are left as they are.

        energy_of_body `(N,)` : bodies with more of it are moved more often.
        """
        count = len(rotation)
        weight = np.full(count, 1 / count)
        if energy_of_body.sum() > 0:
            by_energy = TUNING.by_energy_fraction
            weight = (1 - by_energy) * weight + by_energy * energy_of_body / energy_of_body.sum()
        one = int(self.random.choice(count, p=weight))
        likely = self.likely[one]
        if self.random.random() < TUNING.swap_fraction and likely.sum() > 0:
            two = int(self.random.choice(len(likely), p=likely / likely.sum()))
            return self.swapped(rotation, translation, one, two)
        rotation = rotation.copy()
        rotation[one] = Rotation.random(random_state=self.random).as_matrix()
        return rotation, translation

    def swapped(
        self, rotation: np.ndarray, translation: np.ndarray, one: int, two: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Poses with two bodies at each other's position, and along each other's principal axes, either way round."""
        turned, moved = rotation.copy(), translation.copy()
        for body, other in ((one, two), (two, one)):
            flip = self.random.choice(FLIPS)
            if self.random.random() < TUNING.exchanged_axes_fraction:
                flip = flip @ self.random.choice(EXCHANGES)
            turned[body] = rotation[other] @ self.axes[other] @ flip @ self.axes[body].T
            moved[body] = translation[other]
        return turned, moved


def _principal_axes(body: Body) -> np.ndarray:
    """`(3, 3)` a rotation whose columns are the solid's principal axes, the longest extent's first."""
    solid = trimesh.Trimesh(body.solid_vertices, body.solid_faces, process=False)
    axes = np.linalg.eigh(solid.moment_inertia)[1]
    return axes * np.array([np.linalg.det(axes), 1, 1])
