"""Containers: a box or any closed mesh, with its signed distance and its views. World coordinates, metres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
import trimesh
from torch import Tensor

from ..util.errors import InputError, MeshError
from . import sdf
from .cameras import Camera, box_views, spread_views
from .cavities import cavity
from .loading import METRES, Reading, load_body
from .meshes import Body, make_body

CAVITY = "cavity:"  # before a vessel's path
CELLS, FINE_CELLS = 96, 128  # of a mesh's grid, and of one with zones, which may be thin
MARGIN = 1.1  # the edge of a viewing volume over the largest distance that the container spans in it


class Container:
    """A closed region of space that bodies must stay in.

    body : its surface, in the world's coordinates. size `(3,)` where it is a box about the origin, else None.
    directions : azimuth and elevation in degrees of each view; None for the paper's. whole : of what is left of a
    container that was shrunk, that container. base, zones : the container without these bodies, where they lie, see
    `zones.without`. Raises InputError for no direction.
    """

    def __init__(
        self,
        body: Body,
        size: np.ndarray | None = None,
        directions: Sequence[tuple[float, float]] | None = None,
        whole: Container | None = None,
        base: Container | None = None,
        zones: Sequence[Body] = (),
    ):
        if directions is not None and not len(directions):
            raise InputError("at least one view is needed, got none")
        self.body = body
        self.size = size
        self.directions = directions
        self.whole = self if whole is None else whole
        self.base = self if base is None else base
        self.zones = tuple(zones)
        self._stacks: dict[tuple, sdf.GridStack] = {}
        self._lengths: dict[tuple, Tensor] = {}

    @property
    def volume(self) -> float:
        """Cubic metres."""
        return self.body.volume

    @property
    def bounds(self) -> np.ndarray:
        """`(2, 3)`, lowest and highest corner."""
        return np.stack([self.body.solid_vertices.min(0), self.body.solid_vertices.max(0)]) + self.body.centre

    def views(self, margin: float = MARGIN) -> list[Camera]:
        """The views in `directions`, else the paper's: the three faces of a box, five spread directions for a mesh.

        margin : the viewing volume's edge over the largest distance that the container spans in it.
        """
        if self.base is not self:
            return self.base.views(margin)
        centre, diagonal = self.bounds.mean(0), float(np.linalg.norm(np.ptp(self.bounds, axis=0)))
        if self.directions is not None:
            return [Camera(*angles, margin * diagonal, tuple(centre.tolist())) for angles in self.directions]
        if self.size is not None:
            return box_views(margin * float(self.size.max()), centre)
        return spread_views(5, margin * diagonal, centre)

    def seen_from(self, directions: Sequence[tuple[float, float]]) -> Container:
        """The same with other views: azimuth and elevation of each in degrees."""
        return Container(self.body, self.size, directions)

    def scaled(self, factor: float) -> Container:
        """The same, `factor` times as large about the world's origin."""
        body, size = self.body.scaled(factor), None if self.size is None else self.size * factor
        base = None if self.base is self else self.base.scaled(factor)
        return Container(body, size, self.directions, base=base, zones=[zone.scaled(factor) for zone in self.zones])

    def signed_distance(self, points: Tensor) -> tuple[Tensor, Tensor]:
        """Distance `(M,)` to the wall, negative inside, and its gradient `(M, 3)`, at world points `(M, 3)`.

        Exact for a box; for a mesh from its grid, as accurate as `sdf.GridStack.sample`.
        """
        if self.size is None:
            first = torch.zeros(len(points), dtype=torch.int64, device=points.device)
            return self._stack(points.device, points.dtype).sample(first, points - self._kept(self.body.centre, points))
        half = self._kept(self.size / 2, points)
        beyond = points.abs() - half
        outside = beyond.clamp(min=0)
        distance = outside.norm(dim=1)
        deepest, axis = beyond.max(1)
        inner = (axis[:, None] == torch.arange(3, device=points.device)).to(points.dtype)
        gradient = torch.where((deepest > 0)[:, None], outside / distance.clamp(min=1e-30)[:, None], inner)
        return torch.where(deepest > 0, distance, deepest), gradient * torch.where(points < 0, -1.0, 1.0)

    def arrays(self, dtype: torch.dtype) -> tuple:
        """half, centre and grid for the compiled loops, see `kernels.grid`."""
        if self.size is None:
            return np.zeros(0), self.body.centre, self._stack(torch.device("cpu"), dtype).arrays
        return self.size / 2, np.zeros(3), sdf.GridStack([], dtype=dtype).arrays

    def _stack(self, device: torch.device, dtype: torch.dtype) -> sdf.GridStack:
        if (device, dtype) not in self._stacks:
            grid = sdf.bake_cached(self.body, cells=FINE_CELLS if self.zones else CELLS, padding=16)
            self._stacks[device, dtype] = sdf.GridStack([grid], device, dtype)
        return self._stacks[device, dtype]

    def _kept(self, lengths: np.ndarray, like: Tensor) -> Tensor:
        """The same lengths in every call, as a tensor like another; on a GPU they are sent there once."""
        if (like.device, like.dtype) not in self._lengths:
            self._lengths[like.device, like.dtype] = torch.as_tensor(lengths, dtype=like.dtype, device=like.device)
        return self._lengths[like.device, like.dtype]

    def random_points(self, count: int, generator: torch.Generator) -> Tensor:
        """`(count, 3)` float32 points uniform inside, on the CPU."""
        low, high = (torch.as_tensor(corner, dtype=torch.float32) for corner in self.bounds)
        found: list[Tensor] = []
        while sum(map(len, found)) < count:
            points = low + torch.rand(max(64, 4 * count), 3, generator=generator) * (high - low)
            found.append(points[self.signed_distance(points)[0] < 0])
        return torch.cat(found)[:count]


def box(size: Sequence[float]) -> Container:
    """A box of edges `size` (3 lengths in metres) about the origin. Raises InputError where one is not positive."""
    edges = np.asarray(size, np.float64)
    if edges.shape != (3,) or not np.isfinite(edges).all() or (edges <= 0).any():
        raise InputError(f"a box needs three positive edges, got {', '.join(f'{edge:g}' for edge in size)} m")
    mesh = trimesh.creation.box(edges)
    return Container(make_body("container", mesh.vertices, mesh.faces), edges)


def from_mesh(path: str | Path, reading: Reading = METRES) -> Container:
    """A container from a mesh file, in the file's coordinates. Raises MeshError if it bounds no solid."""
    return Container(load_body(path, reading))


def cavity_of(path: str | Path, reading: Reading = METRES) -> Container:
    """What a vessel's mesh holds, in the file's coordinates: its cavities, or what a surface without thickness encloses
    up to its rim. Raises MeshError if it holds nothing."""
    try:
        inside = cavity(load_body(path, reading))
    except MeshError:
        inside = load_body(path, replace(reading, repair="cap"))
    if inside is None:
        raise MeshError(f"{path}: has no cavity; leave out --cavity to pack into the solid itself")
    return Container(inside)


@dataclass(frozen=True)
class FreeBox:
    """A box that is yet to be found.

    edges : three lengths in metres, None where an edge is free. cube : all edges are free and equal. margin : metres
    on each side that are kept clear of a larger box, which is what is meant. zones : closed bodies that it is without,
    about the middle of its base and up from its floor, whatever its height turns out to be; see `zones.free_without`.
    """

    edges: tuple[float | None, float | None, float | None]
    cube: bool = False
    margin: float = 0.0
    zones: tuple[Body, ...] = ()

    @property
    def free(self) -> np.ndarray:
        """`(3,)` bool: the edges that are free."""
        return np.array([edge is None for edge in self.edges])

    def lengths(self, free: float | np.ndarray) -> np.ndarray:
        """`(3,)` edges in metres: those that are given, and `free`, one or `(3,)`, for the others."""
        return np.array(
            [other if edge is None else edge for edge, other in zip(self.edges, np.broadcast_to(free, 3), strict=True)]
        )

    def sized(self, volume: float) -> np.ndarray:
        """`(3,)` edges of the box of this volume whose free edges are equal."""
        fixed = [edge for edge in self.edges if edge is not None]
        return self.lengths((volume / np.prod(fixed)) ** (1 / (3 - len(fixed))))


def parse(text: str, reading: Reading = METRES, folder: str | Path = ".") -> Container | FreeBox:
    """A container from its description.

    `box:0.32,0.32,0.30` (in the reading's unit), `auto`, `auto:cube` or `auto:0.32,0.32,*` (a box to be found, * its
    free edges), the path of a mesh, or `cavity:` and the path of a vessel's mesh; paths are relative to `folder`.
    Raises InputError with the remedy.
    """
    if text == "auto" or text.startswith("auto:"):
        return _parse_free(text, reading.metres)
    if text.startswith(CAVITY):
        return cavity_of(Path(folder, text.removeprefix(CAVITY)), reading)
    if not text.startswith("box:"):
        return from_mesh(Path(folder, text), reading)
    try:
        edges = [float(word) for word in text[4:].split(",")]
    except ValueError:
        edges = []
    if len(edges) != 3 or not all(np.isfinite(edge) and edge > 0 for edge in edges):
        raise InputError(f"container {text!r} is not a box; write three positive edges, as in box:0.32,0.32,0.30")
    return box([edge * reading.metres for edge in edges])


def _parse_free(text: str, metres: float) -> FreeBox:
    shape = text.partition(":")[2] or "*,*,*"
    if shape == "cube":
        return FreeBox((None, None, None), cube=True)
    try:
        edges = [None if word.strip() == "*" else float(word) for word in shape.split(",")]
    except ValueError:
        edges = []
    if len(edges) != 3 or None not in edges or not all(e is None or (np.isfinite(e) and e > 0) for e in edges):
        raise InputError(f"container {text!r} is not a box to be found; write auto, auto:cube or auto:0.32,0.32,*")
    return FreeBox(tuple(edge if edge is None else edge * metres for edge in edges))
