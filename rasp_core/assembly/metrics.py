"""How well an assembly is done, as the literature on fractures measures it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from ..geometry.meshes import Body
from ..util.errors import InputError

SAMPLES = 3000  # points of each part's surface
RIGHT = 0.01  # of the whole's diagonal: the Chamfer distance under which a part has its place


@dataclass(frozen=True)
class Accuracy:
    """Errors of each part `(N,)`, the assembly aligned to the truth by the part of the largest volume.

    chamfer : mean of nearest distances between the part and its true place, both ways, over the whole's diagonal; it
    judges by shape, so that a symmetric part may be turned. rotation : degrees. translation : of the part's centre,
    over the diagonal.
    """

    chamfer: np.ndarray
    rotation: np.ndarray
    translation: np.ndarray

    @property
    def parts(self) -> float:
        """Share of the parts that have their places."""
        return float((self.chamfer < RIGHT).mean())


def measure(bodies: Sequence[Body], matrices: np.ndarray, truth: np.ndarray) -> Accuracy:
    """Errors of parts placed by `matrices` `(N, 4, 4)`; `truth` `(N, 4, 4)` places them rightly. Raises InputError
    where there are not as many of each."""
    if not len(bodies) == len(matrices) == len(truth):
        raise InputError(f"{len(bodies)} parts need as many poses, got {len(matrices)} and {len(truth)} true ones")
    largest = max(range(len(bodies)), key=lambda i: bodies[i].volume)
    home = truth[largest] @ np.linalg.inv(matrices[largest])
    corners = np.concatenate([body.placed(matrix) for body, matrix in zip(bodies, truth, strict=True)])
    diagonal = float(np.linalg.norm(np.ptp(corners, axis=0)))
    rows = []
    for body, matrix, right in zip(bodies, matrices, truth, strict=True):
        mesh = trimesh.Trimesh(body.placed(np.eye(4)), body.solid_faces, process=False)
        points = np.asarray(trimesh.sample.sample_surface(mesh, SAMPLES, seed=0)[0])
        there, here = trimesh.transform_points(points, home @ matrix), trimesh.transform_points(points, right)
        chamfer = (cKDTree(here).query(there)[0].mean() + cKDTree(there).query(here)[0].mean()) / 2
        moved = home @ matrix @ np.linalg.inv(right)
        # by the chord, not the trace, whose rounding hides small angles
        chord = np.linalg.norm(moved[:3, :3] - np.eye(3)) / np.sqrt(8)
        angle = np.degrees(2 * np.arcsin(min(chord, 1.0)))
        centre = np.append(body.centre, 1)
        apart = np.linalg.norm((home @ matrix @ centre - right @ centre)[:3])
        rows.append((chamfer / diagonal, angle, apart / diagonal))
    return Accuracy(*np.array(rows).T)
