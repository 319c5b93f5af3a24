"""What a mesh file holds: its parts, the unit that it states, and what was left out or changed in reading it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class FilePart:
    """One part of a mesh file.

    name : as the file gives it, "" if it gives none. vertices `(V, 3)` float64 in the file's unit, transforms of the
    scene applied; faces `(F, 3)` int64. cuts : surfaces (vertices, faces) whose inside is to be cut away.
    """

    name: str
    vertices: np.ndarray
    faces: np.ndarray
    cuts: tuple[tuple[np.ndarray, np.ndarray], ...] = ()


@dataclass(frozen=True)
class MeshFile:
    """A mesh file as it was read.

    metres : the length of the unit that the file states, None for kinds that state none (STL, OBJ, OFF, PLY).
    notes : a line each, without the file's name, of what was left out, changed or assumed.
    """

    parts: tuple[FilePart, ...]
    metres: float | None
    notes: tuple[str, ...] = ()


def placed(vertices: np.ndarray, faces: np.ndarray, matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A surface `(V, 3)`, `(F, 3)` moved by `matrix` `(4, 4)`; a mirror turns its faces, so that outside stays so."""
    with np.errstate(all="ignore"):  # coordinates that are not finite are refused later, by name
        moved = vertices @ matrix[:3, :3].T + matrix[:3, 3]
        mirrored = np.linalg.det(matrix[:3, :3]) < 0
    return moved, faces[:, ::-1] if mirrored else faces


def joined(surfaces: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Several surfaces, each `(V, 3)` and `(F, 3)`, as one; nothing is welded."""
    if not surfaces:
        return np.empty((0, 3)), np.empty((0, 3), np.int64)
    first = np.cumsum([0, *(len(vertices) for vertices, _ in surfaces)])
    faces = [faces + start for (_, faces), start in zip(surfaces, first[:-1], strict=True)]
    return np.concatenate([vertices for vertices, _ in surfaces]), np.concatenate(faces)


def used_only(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A surface without the vertices that no face names, the others in the same order.

    faces : `(F, 3)` within the bounds of `vertices` `(V, 3)`.
    """
    kept = np.zeros(len(vertices), bool)
    kept[faces.ravel()] = True
    if kept.all():
        return vertices, faces
    return vertices[kept], (np.cumsum(kept) - 1)[faces]
