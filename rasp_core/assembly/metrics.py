"""Errors of an assembly, as the literature on fractures measures them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from ..geometry.meshes import Body
from ..geometry.surface_points import surface_points
from ..util.errors import InputError

SAMPLES = 3000  # points of each part's surface
RIGHT_DIAGONALS = 0.01  # Chamfer distance, in the whole's diagonal, under which a part is in its place


@dataclass(frozen=True)
class Accuracy:
    """Errors of each part `(N,)`, the assembly aligned to the truth by the part of the largest volume.

    chamfer : mean of nearest distances between the part and itself in its true pose, both ways, over the whole's
    diagonal; it compares shapes, so a symmetric part may be turned. rotation : degrees. translation : of the part's
    centre, over the diagonal.
    """

    chamfer: np.ndarray
    rotation: np.ndarray
    translation: np.ndarray

    @property
    def parts(self) -> float:
        """Fraction of the parts that are in their places."""
        return float((self.chamfer < RIGHT_DIAGONALS).mean())


def measure(bodies: Sequence[Body], matrices: np.ndarray, truth: np.ndarray) -> Accuracy:
    """Errors of parts placed by `matrices` `(N, 4, 4)`; `truth` `(N, 4, 4)` holds their true poses. Raises InputError
    if there are not as many of each."""
    if not len(bodies) == len(matrices) == len(truth):
        raise InputError(f"{len(bodies)} parts need as many poses, got {len(matrices)} and {len(truth)} true ones")
    largest = max(range(len(bodies)), key=lambda i: bodies[i].volume)
    home = truth[largest] @ np.linalg.inv(matrices[largest])
    corners = np.concatenate([body.placed(matrix) for body, matrix in zip(bodies, truth, strict=True)])
    diagonal = float(np.linalg.norm(np.ptp(corners, axis=0)))
    rows = []
    for body, matrix, right in zip(bodies, matrices, truth, strict=True):
        points, _ = surface_points(body.placed(np.eye(4)), body.solid_faces, SAMPLES)
        there, here = trimesh.transform_points(points, home @ matrix), trimesh.transform_points(points, right)
        chamfer = (cKDTree(here).query(there)[0].mean() + cKDTree(there).query(here)[0].mean()) / 2
        moved = home @ matrix @ np.linalg.inv(right)
        # not by the trace, as `poses.degrees_between`: its rounding hides small angles
        angle = np.degrees(Rotation.from_matrix(moved[:3, :3]).magnitude())
        centre = np.append(body.centre, 1)
        apart = np.linalg.norm((home @ matrix @ centre - right @ centre)[:3])
        rows.append((chamfer / diagonal, angle, apart / diagonal))
    return Accuracy(*np.array(rows).T)
