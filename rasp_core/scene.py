"""The tensors of one problem: bodies, container and views on one device, built once and used at every iteration."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import torch
import trimesh
from torch import Tensor

from .contact import SurfaceSamples
from .geometry.cameras import Camera
from .geometry.containers import Container
from .geometry.meshes import Alike, Body, make_body
from .geometry.sdf import CELLS, GridStack
from .geometry.silhouette_edges import Outlines, Views
from .silhouettes import render_at_rest
from .util.errors import InputError

SAMPLE_SPACING = 2.0  # between surface samples, in cells of the body's grid
MIN_SAMPLES, MAX_SAMPLES = 200, 2000  # for one body


class Scene:
    """N bodies in a container before K views.

    outlines, stack, views : what the losses need, see their modules. half `(N, 3)`, radius `(N,)`: the bodies' boxes
    and spheres. samples : points on their surfaces. width : the widest view's, metres. movers : how many of the bodies,
    the first ones, may move; the `obstacles` behind them stay. stack : the bodies' grids, where they are at hand.

    Raises InputError where nothing can move.
    """

    def __init__(
        self,
        bodies: Sequence[Body],
        container: Container,
        cameras: Sequence[Camera],
        device: str | torch.device = "cpu",
        dtype: torch.dtype = torch.float32,
        obstacles: int = 0,
        stack: GridStack | None = None,
    ):
        if not 0 <= obstacles < len(bodies):
            raise InputError("there is nothing to arrange; give at least one object that may move")
        self.movers = len(bodies) - obstacles
        self.bodies, self.container, self.cameras = list(bodies), container, list(cameras)
        self.device, self.dtype = resolve_device(device), dtype
        self.width = max(camera.width for camera in cameras)
        self.outlines = Outlines(bodies, self.device, dtype)
        self.stack = GridStack.of_bodies(bodies, self.device, dtype) if stack is None else stack
        self.views = Views(cameras, self.device, dtype)
        self.moving_vertices = sum(len(body.solid_vertices) for body in bodies[: self.movers])
        self.half = self._tensor([body.half_extents for body in bodies])
        self.radius = self._tensor([body.radius for body in bodies])
        self.samples = surface_samples(bodies, self.device, dtype)

    def container_silhouettes(self, resolution: int, height: float = 1.0) -> Tensor:
        """The container's own silhouettes `(K, resolution, resolution)`, the targets of packing.

        height : the container is squeezed upon its floor to this share of its height before.
        """
        body, floor = self.container.body, self.container.bounds[0, 2]
        if height != 1:
            corners = body.solid_vertices + body.centre
            corners[:, 2] = floor + height * (corners[:, 2] - floor)
            body = make_body(body.name, corners, body.solid_faces)
        return render_at_rest(body, self.views, resolution)

    def _tensor(self, rows) -> Tensor:
        return torch.as_tensor(np.asarray(rows, np.float64), device=self.device, dtype=self.dtype)


def surface_samples(
    bodies: Sequence[Body],
    device: str | torch.device = "cpu",
    dtype=torch.float32,
    spacing: float = SAMPLE_SPACING,
) -> SurfaceSamples:
    """Points on the surface of each body, in its frame, and the area that each stands for.

    spacing : between them, in cells of the body's signed distance grid.
    """
    points = [_cached_points(Alike(body), spacing) for body in bodies]
    count = torch.tensor([len(p) for p in points], device=device)
    area = [np.full(len(p), body.manifold.surface_area() / len(p)) for body, p in zip(bodies, points, strict=True)]
    points, area = (torch.as_tensor(np.concatenate(x), device=device, dtype=dtype) for x in (points, area))
    return SurfaceSamples(points, count.cumsum(0) - count, count, area)


def resolve_device(name: str | torch.device) -> torch.device:
    """`auto` (a GPU where there is one), `cpu`, `cuda`, `cuda:1`, `mps`. Raises InputError where it is not there."""
    if str(name) == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    try:
        device = torch.device(name)
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError, NotImplementedError) as error:
        raise InputError(f"device {str(name)!r} is not available here; use auto or cpu") from error
    return device


@lru_cache(maxsize=1024)
def _cached_points(key: Alike, spacing: float) -> np.ndarray:
    """`(S, 3)` vertices of the solid (at most half of the points) and points spread over its faces by area."""
    body = key.body
    apart = spacing * 2 * body.half_extents.max() / CELLS
    mesh = trimesh.Trimesh(body.solid_vertices, body.solid_faces, process=False)
    wanted = int(np.clip(mesh.area / apart**2, MIN_SAMPLES, MAX_SAMPLES))
    spread, _ = trimesh.sample.sample_surface(mesh, wanted, seed=0)
    corners = body.solid_vertices
    if len(corners) > wanted:
        corners = corners[np.linspace(0, len(corners) - 1, wanted).astype(int)]
    return np.concatenate([corners, np.asarray(spread)])
