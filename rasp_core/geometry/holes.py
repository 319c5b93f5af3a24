"""Holes of a surface: found, measured, and closed if they are small."""

from __future__ import annotations

from dataclasses import dataclass

import manifold3d
import numpy as np

from .shells import mates

FLAT = 0.1  # of a hole's radius: how far from its plane its corners may lie to be closed as a flat polygon


@dataclass(frozen=True)
class Hole:
    """A closed row of open edges. corners `(N,)`: vertices, in the order in which a lid's faces run. length : around
    it, centre `(3,)`; in the mesh's unit."""

    corners: np.ndarray
    length: float
    centre: np.ndarray


def find_holes(vertices: np.ndarray, faces: np.ndarray) -> list[Hole]:
    """The holes of a surface `(V, 3)`, `(F, 3)`, the longest first; open edges that form no closed row are one with no
    corners."""
    mate, count = mates(vertices, faces), len(faces)
    free = np.flatnonzero(mate < 0)
    start, end = faces[free % count, free // count], faces[free % count, (free // count + 1) % 3]
    after: dict[int, list[int]] = {}  # a lid runs against the faces: from each edge's end to its start
    for a, b in zip(end.tolist(), start.tolist(), strict=True):
        after.setdefault(a, []).append(b)
    found, loose = [], []
    while after:
        first = next(iter(after))
        row, at = [first], first
        while at in after:
            at_next = after[at].pop()
            if not after[at]:
                del after[at]
            if at_next in row:  # a loop closes, perhaps a smaller one than was begun
                k = row.index(at_next)
                found.append(_measured(vertices, np.array(row[k:])))
                row = row[: k + 1]
            else:
                row.append(at_next)
            at = at_next
        loose += row[1:] if len(row) > 1 else []
    if loose:
        found.append(Hole(np.zeros(0, int), 0.0, vertices[loose].mean(0)))
    return sorted(found, key=lambda hole: -hole.length)


def _measured(vertices: np.ndarray, corners: np.ndarray) -> Hole:
    points = vertices[corners]
    after = np.roll(points, -1, axis=0)
    return Hole(corners, float(np.linalg.norm(after - points, axis=1).sum()), points.mean(0))


def lid(vertices: np.ndarray, hole: Hole) -> np.ndarray:
    """Faces `(N - 2, 3)` over a hole: of a flat one a triangulated polygon, else those of the least area."""
    if len(hole.corners) < 3:
        return np.zeros((0, 3), np.int64)
    if len(hole.corners) == 3:
        return hole.corners[None]
    points = vertices[hole.corners] - hole.centre
    size = np.linalg.norm(points, axis=1).max()
    after = np.roll(points, -1, axis=0)
    normal = np.cross(points, after).sum(0)
    if np.linalg.norm(normal) > 0.05 * size**2:
        normal /= np.linalg.norm(normal)
        if np.abs(points @ normal).max() < FLAT * size:
            first = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
            first /= np.linalg.norm(first)
            flat = np.stack([points @ first, points @ np.cross(normal, first)], 1)
            chosen = np.asarray(manifold3d.triangulate([flat])).reshape(-1, 3)
            if len(chosen) == len(points) - 2:
                return hole.corners[chosen]
    return hole.corners[_least_area(points)]


def _least_area(points: np.ndarray) -> np.ndarray:
    """Triangles `(N - 2, 3)` of the polygon `(N, 3)` in space with the least area together (Barequet & Sharir 1995)."""
    count = len(points)
    if count > 300:
        return np.array([(0, k, k + 1) for k in range(1, count - 1)])
    cost, best = np.zeros((count, count)), np.zeros((count, count), int)
    for span in range(2, count):
        for i in range(count - span):
            j = i + span
            between = np.arange(i + 1, j)
            area = np.linalg.norm(np.cross(points[between] - points[i], points[j] - points[i]), axis=1)
            total = cost[i, between] + cost[between, j] + area
            k = int(total.argmin())
            cost[i, j], best[i, j] = total[k], between[k]
    triangles, waiting = [], [(0, count - 1)]
    while waiting:
        i, j = waiting.pop()
        if j - i >= 2:
            k = best[i, j]
            triangles.append((i, k, j))
            waiting += [(i, k), (k, j)]
    return np.array(triangles)
