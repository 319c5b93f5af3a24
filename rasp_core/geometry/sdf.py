"""Signed distance grids: baked once for each distinct body, sampled under poses. Metres, negative inside.

Baking needs open3d; a grid that is in the cache does not.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from torch import Tensor

from ..io.kept_arrays import kept
from ..util import o3d
from .meshes import Body

CELLS = 48  # along the longest edge of the body's bounding box
NEAR = 0.87  # of a cell: how far a grid's nearest value may be from the truth, half a cell's diagonal
PADDING = 2  # cells of outside around the bounding box
CACHE = "sdf"  # folder of kept grids
_FORMAT = 1  # change it when what is cached changes


@dataclass(frozen=True, eq=False)
class Grid:
    """values `(X, Y, Z)` float32 at the points `origin + spacing * index`, axes x, y, z."""

    values: np.ndarray
    origin: np.ndarray
    spacing: float


def bake(vertices: np.ndarray, faces: np.ndarray, cells: int = CELLS, padding: float = PADDING) -> Grid:
    """Signed distance grid of a closed surface without inner faces.

    vertices `(V, 3)`, faces `(F, 3)`. The grid reaches `padding` cells beyond the bounding box on every side.
    Distances and signs are open3d's (`RaycastingScene.compute_signed_distance`); its signs are ray parities,
    which are wrong on touching pieces: give it the united solid.
    """
    open3d = o3d.load()
    low, high = vertices.min(0), vertices.max(0)
    spacing = float((high - low).max()) / cells
    shape = np.ceil((high - low) / spacing + 2 * padding).astype(int) + 1
    origin = (low + high) / 2 - spacing * (shape - 1) / 2
    axes = [origin[a] + spacing * np.arange(shape[a]) for a in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).astype(np.float32)
    scene = o3d.caster([(vertices, faces)])
    values = scene.compute_signed_distance(open3d.core.Tensor(points), nsamples=3).numpy()
    return Grid(np.ascontiguousarray(values, np.float32), origin, spacing)


def bake_cached(body: Body, cells: int = CELLS, padding: float = PADDING) -> Grid:
    """`bake` of the body's solid, kept on disk under the hash of its geometry."""

    def baked() -> dict[str, np.ndarray]:
        grid = bake(body.solid_vertices, body.solid_faces, cells, padding)
        return {"values": grid.values, "origin": grid.origin, "spacing": np.array(grid.spacing)}

    found = kept(CACHE, f"{_FORMAT} {body.digest} {cells} {padding}", baked)
    return Grid(found["values"], found["origin"], float(found["spacing"]))


class GridStack:
    """The grids of N bodies in one flat tensor, equal bodies sharing one grid.

    values : flat float32 (or `dtype`), all grids one after the other, z fastest.
    start `(N,)` int64, shape `(N, 3)` int64, origin `(N, 3)`, spacing `(N,)`: each body's grid.
    """

    def __init__(self, grids: Sequence[Grid], device: str | torch.device = "cpu", dtype=torch.float32):
        distinct = {id(grid): grid for grid in grids}
        starts, flat, at = {}, [], 0
        for key, grid in distinct.items():
            starts[key] = at
            flat.append(torch.from_numpy(grid.values).reshape(-1))
            at += grid.values.size
        self.values = torch.cat(flat).to(device, dtype) if flat else torch.zeros(0, device=device, dtype=dtype)
        self.start = torch.tensor([starts[id(grid)] for grid in grids], device=device, dtype=torch.int64)
        shapes = [grid.values.shape for grid in grids]
        self.shape = torch.tensor(shapes, device=device, dtype=torch.int64).reshape(-1, 3)
        self.origin = torch.tensor(np.array([g.origin for g in grids]).reshape(-1, 3), device=device, dtype=dtype)
        self.spacing = torch.tensor([grid.spacing for grid in grids], device=device, dtype=dtype)

    def take(self, bodies: Sequence[int]) -> GridStack:
        """The stack of some of the bodies; the values are shared."""
        taken = copy.copy(self)
        taken.__dict__.pop("arrays", None)
        index = torch.as_tensor(list(bodies), dtype=torch.int64, device=self.start.device)
        for name in ("start", "shape", "origin", "spacing"):
            setattr(taken, name, getattr(self, name)[index])
        return taken

    @cached_property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """values, start, shape, origin and spacing as arrays for the compiled loops."""
        return tuple(x.numpy() for x in (self.values, self.start, self.shape, self.origin, self.spacing))

    @classmethod
    def of_bodies(cls, bodies: Sequence[Body], device="cpu", dtype=torch.float32, cells: int = CELLS) -> GridStack:
        """Bake (or take from the cache) one grid for each distinct body."""
        grids = {digest: None for digest in (body.digest for body in bodies)}
        for body in bodies:
            if grids[body.digest] is None:
                grids[body.digest] = bake_cached(body, cells)
        return cls([grids[body.digest] for body in bodies], device, dtype)

    def nearest(self, body: Tensor, points: Tensor) -> Tensor:
        """Value at the grid point next to each of `points` `(M, 3)` in the frame of `body` `(M,)`; `(M,)`.

        Points beyond the grid take the value at its border. At most `NEAR` of a cell from the truth within.
        """
        return self.at_cells(body, (points - self.origin[body]) / self.spacing[body, None])

    def at_cells(self, body: Tensor, cells: Tensor) -> Tensor:
        """`nearest` for places given in cells of the body's grid, `(M, 3)`."""
        shape = self.shape[body]
        index = torch.minimum(cells.round().long().clamp_(min=0), shape - 1)
        flat = (index[:, 0] * shape[:, 1] + index[:, 1]) * shape[:, 2] + index[:, 2]
        return self.values[self.start[body] + flat]

    def sample(self, body: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
        """Trilinear signed distance `(M,)` and its gradient `(M, 3)` at `points` `(M, 3)`, in body frames.

        body : `(M,)` int64, which body's grid. Beyond the grid, the distance to the grid is added to the value at
        its border, an upper bound of the truth.
        """
        spacing, shape = self.spacing[body], self.shape[body]
        position = (points - self.origin[body]) / spacing[:, None]
        inside = torch.minimum(position.clamp(min=0), (shape - 1).to(position.dtype))
        cell = torch.minimum(inside.long(), shape - 2)
        (fx, fy, fz), (gx, gy, gz) = (inside - cell).unbind(1), (1 - (inside - cell)).unbind(1)
        stride_y = shape[:, 2]
        stride_x = shape[:, 1] * stride_y
        at = self.start[body] + cell[:, 0] * stride_x + cell[:, 1] * stride_y + cell[:, 2]
        c000, c001, c010, c011 = (self.values[at + o] for o in (0, 1, stride_y, stride_y + 1))
        at = at + stride_x
        c100, c101, c110, c111 = (self.values[at + o] for o in (0, 1, stride_y, stride_y + 1))
        c00, c01, c10, c11 = (
            c000 * gx + c100 * fx,
            c001 * gx + c101 * fx,
            c010 * gx + c110 * fx,
            c011 * gx + c111 * fx,
        )
        c0, c1 = c00 * gy + c10 * fy, c01 * gy + c11 * fy
        value = c0 * gz + c1 * fz
        d00, d01, d10, d11 = c100 - c000, c101 - c001, c110 - c010, c111 - c011
        gradient = torch.stack(
            [
                (d00 * gy + d10 * fy) * gz + (d01 * gy + d11 * fy) * fz,
                (c10 - c00) * gz + (c11 - c01) * fz,
                c1 - c0,
            ],
            1,
        )
        beyond = (position - inside) * spacing[:, None]
        distance = beyond.norm(dim=1)
        outward = beyond / distance.clamp(min=1e-30)[:, None]
        clamped = position != inside
        gradient = torch.where(clamped, outward, gradient / spacing[:, None])
        return value + distance, gradient
