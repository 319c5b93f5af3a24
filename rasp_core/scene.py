"""The tensors of one problem: bodies, container and views on one device, built once and used at every iteration."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from .geometry.cameras import Camera
from .geometry.containers import Container
from .geometry.interior_points import InteriorPoints, interior_points
from .geometry.meshes import Body, make_body
from .geometry.sdf import GridStack
from .geometry.silhouette_edges import Outlines, Views
from .geometry.surface_samples import surface_samples
from .kernels import slices
from .poses import freedom_of
from .silhouettes import render_at_rest
from .util.devices import resolve_device
from .util.errors import InputError


class Scene:
    """N bodies in a container before K views.

    outlines, stack, views : what the losses need, see their modules. half `(N, 3)`, radius `(N,)`: the bodies' boxes
    and spheres. samples : points on their surfaces. width : the widest view's, metres. movers : how many of the bodies,
    the first ones, may move, about the axes that `freedom` `(movers, 3)` says, all if None; the `obstacles` behind them
    stay. stack : the bodies' grids, where they are at hand. stray : metres by which the outlines may stray.

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
        stray: float = 0.0,
    ):
        if not 0 <= obstacles < len(bodies):
            raise InputError("there is nothing to arrange; give at least one object that may move")
        self.movers = len(bodies) - obstacles
        self.bodies, self.container, self.cameras = list(bodies), container, list(cameras)
        self.device, self.dtype = resolve_device(device), dtype
        self.width = max(camera.width for camera in cameras)
        self.outlines = Outlines(bodies, self.device, dtype, stray)
        self.stack = GridStack.of_bodies(bodies, self.device, dtype) if stack is None else stack
        self.views = Views(cameras, self.device, dtype)
        self.moving_vertices = sum(len(body.solid_vertices) for body in bodies[: self.movers])
        self.half = self._tensor([body.half_extents for body in bodies])
        self.radius = self._tensor([body.radius for body in bodies])
        self.samples = surface_samples(bodies, self.device, dtype)
        self._material: dict[int, InteriorPoints] = {}
        freedom = freedom_of(bodies[: self.movers])
        self.freedom = None if freedom is None else self._tensor(freedom)

    def container_silhouettes(self, resolution: int, height: float = 1.0, views: Views | None = None) -> Tensor:
        """The container's own silhouettes `(K, resolution, resolution)`, the targets of packing.

        height : the container is squeezed upon its floor to this fraction of its height before. views : others than
        the scene's.
        """
        body, floor = self.container.body, self.container.bounds[0, 2]
        if height != 1:
            corners = body.solid_vertices + body.centre
            corners[:, 2] = floor + height * (corners[:, 2] - floor)
            body = make_body(body.name, corners, body.solid_faces)
        return render_at_rest(body, self.views if views is None else views, resolution)

    def container_slices(self, resolution: int, layers: int) -> Tensor:
        """The container's own slices `(K * layers, resolution, resolution)`, see `kernels.slices`."""
        body = self.container.body
        material = interior_points([body], self.width / resolution, self.device, self.dtype)
        upright = torch.eye(3, device=self.device, dtype=self.dtype)[None]
        return slices.render(material, upright, self._tensor([body.centre]), self.views, resolution, layers)

    def material(self, resolution: int) -> InteriorPoints:
        """Points inside the bodies, about a pixel apart; kept for the next call."""
        if resolution not in self._material:
            spacing = self.width / resolution
            self._material = {resolution: interior_points(self.bodies, spacing, self.device, self.dtype)}
        return self._material[resolution]

    def _tensor(self, rows) -> Tensor:
        return torch.as_tensor(np.asarray(rows, np.float64), device=self.device, dtype=self.dtype)
