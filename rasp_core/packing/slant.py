"""Turns for what fits into a container only at a slant: a rod along a box's diagonal, a board across its floor."""

from __future__ import annotations

import numpy as np
import trimesh

from ..geometry.containers import Container
from ..geometry.meshes import Body

DIRECTIONS = 12  # chords of the container that are tried, the longest first; a box has ten diagonals
ROLLS = 8  # of the body about its longest edge
LONG = 0.5  # of the container's diameter: shorter bodies are not worth so many turns
APART_DEG = 5.0  # directions nearer to each other than that are one


def slanted_turns(body: Body, container: Container) -> np.ndarray:
    """Rotations `(T, 3, 3)` that lay the longest edge of a body's least bounding box along the container's chords.

    A chord joins two corners of the container's convex hull and is longer than the body. First the body's shortest edge
    lies level, so that a board stands upright in a box; then it is rolled about its longest.
    """
    to_box, edges = trimesh.bounds.oriented_bounds(body.hull_corners)
    order = np.argsort(-edges, kind="stable")
    axes = to_box[:3, :3][order]
    axes[2] = np.cross(axes[0], axes[1])  # length, width and thickness of the body, a right-handed frame
    directions = _directions(container.body.hull_corners, float(edges.max()))
    turns = []
    for angle in np.arange(ROLLS) * np.pi / ROLLS:
        for along in directions:
            level = np.cross(along, np.eye(3)[2])
            level = level if np.linalg.norm(level) > 1e-6 else np.eye(3)[0]
            level = level / np.linalg.norm(level)
            width = np.cos(angle) * np.cross(level, along) + np.sin(angle) * level
            turns.append(np.stack([along, width, np.cross(along, width)], 1) @ axes)
    return np.array(turns).reshape(-1, 3, 3)


def fits_straight(body: Body, container: Container) -> bool:
    """Whether a body's box, turned by quarter turns, is no longer than the container's along any axis."""
    return bool((np.sort(2 * body.half_extents) <= np.sort(np.ptp(container.bounds, axis=0))).all())


def is_long(body: Body, container: Container) -> bool:
    """Whether a body is so long for its container that a slant may help."""
    return bool(body.radius > LONG * container.body.radius)


def _directions(corners: np.ndarray, least: float) -> list[np.ndarray]:
    """Unit vectors `(3,)` of the chords between corners `(V, 3)` that are longer than `least`, the longest first."""
    found: list[np.ndarray] = []
    if len(corners) > 200:  # of a round container any few do
        corners = corners[np.linspace(0, len(corners) - 1, 200).astype(int)]
    first, second = np.triu_indices(len(corners), 1)
    chords = corners[second] - corners[first]
    lengths = np.linalg.norm(chords, axis=1)
    for k in np.argsort(-lengths.round(9), kind="stable"):
        if lengths[k] <= least or len(found) == DIRECTIONS:
            break
        chord = chords[k] / lengths[k]
        if all(abs(chord @ other) < np.cos(np.radians(APART_DEG)) for other in found):
            found.append(chord)
    return found
