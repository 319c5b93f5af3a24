"""Solids for exact booleans where poses put them, and what is inside grown ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import manifold3d
import numpy as np

from ..geometry.containers import Container
from ..geometry.meshes import Body

ABOUT = 1.5  # a container's extent: the space about it of which its wall is the inside


def placed_solid(body: Body, matrix: np.ndarray) -> manifold3d.Manifold:
    """The body's solid where `matrix` `(4, 4)`, from file coordinates to the world, puts it."""
    pose = np.asarray(matrix, np.float64)[:3].copy()
    pose[:, 3] += pose[:, :3] @ body.centre
    return body.manifold.transform(pose)


def distance_to_wall(container: Container) -> Callable[[manifold3d.Manifold, float], float]:
    """What says how far a solid is from the wall, up to a reach in metres; 0 where it sticks out."""
    if container.size is not None:
        half = container.size / 2

        def to_box(solid: manifold3d.Manifold, reach: float) -> float:
            least = (half - np.abs(np.array(solid.bounding_box()).reshape(2, 3))).min()
            return float(np.clip(least, 0, reach))

        return to_box
    low, high = container.bounds
    beyond = ABOUT * float((high - low).max())
    block = manifold3d.Manifold.cube(high - low + 2 * beyond).translate(low - beyond)
    outside = block - container.body.manifold.translate(container.body.centre)

    def to_mesh(solid: manifold3d.Manifold, reach: float) -> float:
        lowest, highest = np.array(solid.bounding_box()).reshape(2, 3)
        if (lowest < low).any() or (highest > high).any():  # it may lie beyond the space about the container
            return 0.0
        return float(outside.min_gap(solid, reach))

    return to_mesh


def cores_apart(bodies: Sequence[Body], matrices: np.ndarray, i: int, j: int, spare: float) -> bool:
    """Whether two bodies, or those inside grown ones, are as far apart as both are grown; spare : a fraction more."""
    first, second = bodies[i], bodies[j]
    need = (first.growth + second.growth) * (1 + spare)
    return placed_solid(first.inside, matrices[i]).min_gap(placed_solid(second.inside, matrices[j]), 2 * need) >= need


def core_inside(body: Body, matrix: np.ndarray, container: Container, spare: float) -> bool:
    """Whether the body inside a grown one is as far from the wall as that is grown; spare : a fraction more."""
    need = body.growth * (1 + spare)
    return distance_to_wall(container)(placed_solid(body.inside, matrix), 2 * need) >= need
