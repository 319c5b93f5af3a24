"""Points inside bodies on a lattice in each body's frame, with the volume that each stands for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import torch
from torch import Tensor

from ..util import o3d
from .meshes import Body, SolidKey
from .surface_points import surface_points

LEAST_POINTS = 30  # of one body: where the lattice has fewer inside, it is made finer
FINER = 1.5
MOST_FINER = 2_000_000  # points of a lattice that was made finer
AT_ONCE = 1_000_000  # points that are tried at once


@dataclass(frozen=True)
class InteriorPoints:
    """Points inside N bodies: points `(P, 3)` in body frames, body by body; body `(P,)` int64; volume `(P,)` cubic
    metres that each stands for, which come to each body's volume exactly."""

    points: Tensor
    body: Tensor
    volume: Tensor


def interior_points(
    bodies: Sequence[Body], spacing: float, device: str | torch.device = "cpu", dtype: torch.dtype = torch.float32
) -> InteriorPoints:
    """The points of a lattice of `spacing` metres that lie inside each body, by open3d's signed distance, however many
    these are.

    A body with hardly any has a finer lattice, and one too thin for any lattice has points on its surface.
    """
    points = [_inside(SolidKey(body), spacing) for body in bodies]
    counts = [len(each) for each in points]
    volume = np.repeat([body.volume / count for body, count in zip(bodies, counts, strict=True)], counts)
    return InteriorPoints(
        torch.as_tensor(np.concatenate(points), device=device, dtype=dtype),
        torch.as_tensor(np.repeat(np.arange(len(bodies)), counts), device=device),
        torch.as_tensor(volume, device=device, dtype=dtype),
    )


@lru_cache(maxsize=1024)
def _inside(key: SolidKey, spacing: float) -> np.ndarray:
    """`(P, 3)` points in the body's frame."""
    body = key.body
    solid = o3d.caster([(body.solid_vertices, body.solid_faces)])
    counts = _counts(body, spacing)
    points = _lattice_inside(solid, counts, spacing)
    while len(points) < LEAST_POINTS:
        spacing /= FINER
        counts = _counts(body, spacing)
        if counts.prod() > MOST_FINER:  # thinner than any lattice: what is near its surface is all there is
            return surface_points(body.solid_vertices, body.solid_faces, LEAST_POINTS)[0]
        points = _lattice_inside(solid, counts, spacing)
    return points


def _counts(body: Body, spacing: float) -> np.ndarray:
    """How many points `(3,)` a lattice about a body has along each axis."""
    return np.maximum(1, np.ceil(2 * body.half_extents / spacing)).astype(int)


def _lattice_inside(solid, counts: np.ndarray, spacing: float) -> np.ndarray:
    """`(P, 3)` points inside a solid of a lattice about the origin, a few of its planes at a time."""
    x, y, z = ((np.arange(count) - (count - 1) / 2) * spacing for count in counts)
    found = []
    for some in np.array_split(x, max(1, counts.prod() // AT_ONCE)):
        points = np.stack(np.meshgrid(some, y, z, indexing="ij"), -1).reshape(-1, 3)
        inside = solid.compute_signed_distance(points.astype(np.float32), nsamples=3).numpy() < 0
        found.append(points[inside])
    return np.concatenate(found)
