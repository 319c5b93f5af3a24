"""Points on the surfaces of bodies, as dense as their grids, with the area that each stands for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import torch
import trimesh
from torch import Tensor

from .meshes import Body, SolidKey
from .sdf import CELLS
from .surface_points import surface_points

SAMPLE_SPACING = 2.0  # between surface samples, in cells of the body's grid
MIN_SAMPLES, MAX_SAMPLES = 200, 2000  # for one body


@dataclass(frozen=True)
class SurfaceSamples:
    """Points on the bodies' surfaces: points `(S, 3)` in body frames, body by body; count and start `(N,)`;
    area `(S,)` square metres that each stands for."""

    points: Tensor
    start: Tensor
    count: Tensor
    area: Tensor


def surface_samples(
    bodies: Sequence[Body],
    device: str | torch.device = "cpu",
    dtype: torch.dtype = torch.float32,
    spacing: float = SAMPLE_SPACING,
) -> SurfaceSamples:
    """Points on the surface of each body, in its frame, and the area that each stands for.

    spacing : between them, in cells of the body's signed distance grid.
    """
    points = [_body_points(SolidKey(body), spacing) for body in bodies]
    count = torch.tensor([len(p) for p in points], device=device)
    area = [np.full(len(p), body.manifold.surface_area() / len(p)) for body, p in zip(bodies, points, strict=True)]
    points, area = (torch.as_tensor(np.concatenate(x), device=device, dtype=dtype) for x in (points, area))
    return SurfaceSamples(points, count.cumsum(0) - count, count, area)


@lru_cache(maxsize=1024)
def _body_points(key: SolidKey, spacing: float) -> np.ndarray:
    """`(S, 3)` vertices of the solid (at most half of the points) and points spread over its faces by area."""
    vertices, faces = key.body.solid_vertices, key.body.solid_faces
    apart = spacing * 2 * key.body.half_extents.max() / CELLS
    area = trimesh.Trimesh(vertices, faces, process=False).area
    wanted = int(np.clip(area / apart**2, MIN_SAMPLES, MAX_SAMPLES))
    spread, _ = surface_points(vertices, faces, wanted)
    if len(vertices) > wanted:
        vertices = vertices[np.linspace(0, len(vertices) - 1, wanted).astype(int)]
    return np.concatenate([vertices, spread])
