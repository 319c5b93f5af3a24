"""Pools of objects as the figures and benchmarks have them: brought to a size, and as files for other processes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh

from ..geometry.meshes import Body

EDGES = 0.06, 0.12  # metres, the longest edges of CAD parts, whose files have no common unit


def resized(bodies: Sequence[Body], seed: int = 0) -> list[Body]:
    """The bodies with their longest edge brought to 6 to 12 cm, by seed."""
    edges = np.random.default_rng(seed).uniform(*EDGES, len(bodies))
    return [body.scaled(edge / (2 * body.half_extents.max())) for body, edge in zip(bodies, edges, strict=True)]


def as_files(bodies: Sequence[Body], folder: str | Path, divided: bool = False) -> list[str]:
    """Write the bodies' surfaces as STL files into a folder, and name it, as `from_files.load` has objects.

    divided : each face in four. Raises OSError where the folder cannot be written.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for body in bodies:
        mesh = trimesh.Trimesh(body.vertices, body.faces, process=False)
        (mesh.subdivide() if divided else mesh).export(folder / f"{body.name}.stl")
    return [str(folder)]
