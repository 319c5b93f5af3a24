"""Moves that a tight packing wants: two objects change places, or one turns where it is.

An object that takes another's place takes its bearing too, principal axis along principal axis: cans stay aligned with
what is about them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from ..geometry.meshes import Body

SWAPS = 0.7  # share of the moves in which two change places
ALIKE = 0.35  # of the logarithm of their volumes: two that differ so much change places e times less often
TROUBLED = 0.8  # share of the moves that begin with a body chosen by its part of the energy
ASKEW = 0.3  # share of the objects that come to lie with two axes exchanged
FLIPS = np.array([np.diag(signs) for signs in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))], float)
EXCHANGES = np.array([[[0, 1, 0], [-1, 0, 0], [0, 0, 1]], [[1, 0, 0], [0, 0, 1], [0, -1, 0]]], float)


class Moves:
    """Moves among these bodies, drawn from `random`."""

    def __init__(self, bodies: Sequence[Body], random: np.random.Generator):
        self.random = random
        known = {body.digest: _principal_axes(body) for body in bodies}
        self.axes = np.array([known[body.digest] for body in bodies])
        volume, kind = np.log([body.volume for body in bodies]), np.array([body.digest for body in bodies])
        self.likely = np.exp(-np.abs(volume[:, None] - volume) / ALIKE) * (kind[:, None] != kind)

    def any(self, rotation: np.ndarray, translation: np.ndarray, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Poses after a move. rotation `(N, 3, 3)`, translation `(N, 3)`, left as they are."""
        count = len(rotation)
        weight = np.full(count, 1 / count)
        if share.sum() > 0:
            weight = (1 - TROUBLED) * weight + TROUBLED * share / share.sum()
        one = int(self.random.choice(count, p=weight))
        likely = self.likely[one]
        if self.random.random() < SWAPS and likely.sum() > 0:
            return self.swapped(
                rotation, translation, one, int(self.random.choice(len(likely), p=likely / likely.sum()))
            )
        rotation = rotation.copy()
        rotation[one] = Rotation.random(random_state=self.random).as_matrix()
        return rotation, translation

    def swapped(self, rotation, translation, one: int, two: int) -> tuple[np.ndarray, np.ndarray]:
        """Poses with two bodies in each other's place, and along each other's principal axes, either way round."""
        turned, moved = rotation.copy(), translation.copy()
        for body, place in ((one, two), (two, one)):
            flip = self.random.choice(FLIPS)
            if self.random.random() < ASKEW:
                flip = flip @ self.random.choice(EXCHANGES)
            turned[body] = rotation[place] @ self.axes[place] @ flip @ self.axes[body].T
            moved[body] = translation[place]
        return turned, moved


def _principal_axes(body: Body) -> np.ndarray:
    """`(3, 3)` a rotation whose columns are the solid's principal axes, the longest extent's first."""
    solid = trimesh.Trimesh(body.solid_vertices, body.solid_faces, process=False)
    axes = np.linalg.eigh(solid.moment_inertia)[1]
    return axes * np.array([np.linalg.det(axes), 1, 1])
