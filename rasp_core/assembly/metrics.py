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
RIGHT_SQUARE = 0.01  # Breaking Bad's: Chamfer distance of squares, in squares of the whole's longest edge
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


@dataclass(frozen=True)
class BreakingBad:
    """The measures of the benchmark Breaking Bad (Sellan et al. 2022), means over all parts, lengths in the whole's
    longest edge, aligned to the truth by the part of the largest volume.

    rotation_rmse_deg : root mean square of the differences of three Euler angles, each at most 180 degrees.
    translation_rmse : of the three coordinates of the part's centre. chamfer : of the assembled surface and the true
    one, nearest distances squared, their means both ways added. parts : fraction whose own such distance is under 0.01,
    which is far less strict than `Accuracy.parts`.
    """

    rotation_rmse_deg: float
    translation_rmse: float
    chamfer: float
    parts: float


def measure(bodies: Sequence[Body], matrices: np.ndarray, truth: np.ndarray) -> Accuracy:
    """Errors of parts placed by `matrices` `(N, 4, 4)`; `truth` `(N, 4, 4)` holds their true poses. Raises InputError
    if there are not as many of each."""
    home, edges = _aligned(bodies, matrices, truth)
    diagonal = float(np.linalg.norm(edges))
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


def breaking_bad(bodies: Sequence[Body], matrices: np.ndarray, truth: np.ndarray) -> BreakingBad:
    """The same poses by Breaking Bad's measures; arguments and errors as of `measure`."""
    home, edges = _aligned(bodies, matrices, truth)
    unit, turns, shifts, here, there = float(edges.max()), [], [], [], []
    for body, matrix, right in zip(bodies, matrices, truth, strict=True):
        points, _ = surface_points(body.placed(np.eye(4)), body.solid_faces, SAMPLES)
        here.append(trimesh.transform_points(points, right) / unit)
        there.append(trimesh.transform_points(points, home @ matrix) / unit)
        angles = [Rotation.from_matrix(m[:3, :3]).as_euler("xyz", degrees=True) for m in (home @ matrix, right)]
        apart = np.abs(angles[0] - angles[1])
        turns.append(np.sqrt((np.minimum(apart, 360 - apart) ** 2).mean()))
        centre = np.append(body.centre, 1)
        shifts.append(np.sqrt((((home @ matrix - right) @ centre)[:3] ** 2).mean()) / unit)
    chamfer = np.array([_squared_chamfer(a, b) for a, b in zip(here, there, strict=True)])
    return BreakingBad(
        rotation_rmse_deg=float(np.mean(turns)),
        translation_rmse=float(np.mean(shifts)),
        chamfer=_squared_chamfer(np.concatenate(here), np.concatenate(there)),
        parts=float((chamfer < RIGHT_SQUARE).mean()),
    )


def _squared_chamfer(one: np.ndarray, other: np.ndarray) -> float:
    return float((cKDTree(one).query(other)[0] ** 2).mean() + (cKDTree(other).query(one)[0] ** 2).mean())


def _aligned(bodies: Sequence[Body], matrices: np.ndarray, truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The motion `(4, 4)` that brings the part of the largest volume to its true pose, and the true whole's edges
    `(3,)`."""
    if not len(bodies) == len(matrices) == len(truth):
        raise InputError(f"{len(bodies)} parts need as many poses, got {len(matrices)} and {len(truth)} true ones")
    largest = max(range(len(bodies)), key=lambda i: bodies[i].volume)
    corners = np.concatenate([body.placed(matrix) for body, matrix in zip(bodies, truth, strict=True)])
    return truth[largest] @ np.linalg.inv(matrices[largest]), np.ptp(corners, axis=0)
