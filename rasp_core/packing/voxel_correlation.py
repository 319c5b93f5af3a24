"""Objects and a container as voxels, and where an object goes among others, all shifts at once by Fourier transforms.

After Cui et al. 2023, Dense, Interlocking-Free and Scalable Spectral Packing of Generic 3D Objects: one correlation
counts the voxels that an object would share with what is there; a second adds up the distances of its voxels to what is
there, walls included.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
import trimesh
from scipy import fft, ndimage

from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..geometry.sdf import Grid
from ..geometry.wishes import quarter_turns
from ..geometry.zones import distance_to
from ..util import o3d


@dataclass(frozen=True)
class VoxelTuning:
    """How fine voxels are, and what rules of placement prefer."""

    finest_of_container_edge: float = 1 / 64  # the longest edge, or of
    longest_of_mean_edge: float = 1.5  # times the mean edge, if that is less: a long container is as fine across
    rounding_voxels: float = 1e-3  # that an object may reach into the next voxel
    most_lengths: int = 100  # of the edges of objects' boxes, if objects are made of equal cubes
    distinct_lengths_voxels: float = 1e-4  # between two of them, at least, that count as two
    coarser_than_finest: int = 4  # times: only voxels so much coarser are looked at
    floor_bias_voxels: float = 1e-2  # Cui's: voxels of distance that the ceiling costs
    corner_bias_voxels: float = 1.0  # Wang & Hauser's: voxels of height that a step along x or y costs
    threaded_from_voxels: int = 50_000  # from which a transform is worth several threads


TUNING = VoxelTuning()


def choose_voxel(bodies: Sequence[Body], container: Container) -> float:
    """The voxel's edge in metres: fine, or the coarsest that covers the objects as closely.

    Objects made of equal cubes, with some play or none, get that cube, others 1/64 of the container's edge.
    """
    distinct = list({body.digest: body for body in bodies}.values())
    edges = np.concatenate([2 * body.half_extents for body in distinct])
    size = np.ptp(container.bounds, axis=0)
    longest = min(size.max(), TUNING.longest_of_mean_edge * size.prod() ** (1 / 3))
    finest = TUNING.finest_of_container_edge * float(longest)

    def waste(voxel: float) -> float:  # how much longer the objects' boxes become
        return float((np.ceil(edges / voxel - TUNING.rounding_voxels) * voxel / edges).mean())

    def covered(voxel: float) -> float:
        return sum(Turned.covering(body, np.eye(3), voxel).voxels.sum() for body in distinct) * voxel**3

    lengths = np.sort(edges)
    lengths = lengths[np.append(np.diff(lengths) > TUNING.distinct_lengths_voxels * finest, True)]
    if len(lengths) > TUNING.most_lengths:
        return finest
    coarser = TUNING.coarser_than_finest
    parts = {edge / n for edge in lengths.tolist() for n in range(1, int(edge / finest / coarser) + 1)}
    likely = [voxel for voxel in sorted(parts, reverse=True) if waste(voxel) < waste(finest)]
    close = covered(finest) if likely else 0.0
    return next((voxel for voxel in likely if covered(voxel) <= close), finest)


@dataclass(frozen=True)
class Turned:
    """A body turned by `rotation` `(3, 3)`, as voxels `(X, Y, Z)` bool; its centre lies at `centre` `(3,)` metres from
    the corner of the first one."""

    rotation: np.ndarray
    voxels: np.ndarray
    centre: np.ndarray

    @classmethod
    def covering(cls, body: Body, rotation: np.ndarray, voxel: float) -> Turned:
        """Every voxel that the solid touches, by open3d's voxeliser, and those whose middle it holds."""
        open3d = o3d.load()
        vertices = body.solid_vertices @ rotation.T
        low, size = vertices.min(0), np.ptp(vertices, axis=0)
        shape = np.maximum(np.ceil(size / voxel - TUNING.rounding_voxels).astype(int), 1)
        normals = trimesh.Trimesh(body.solid_vertices, body.solid_faces, process=False).vertex_normals @ rotation.T
        # the surface drawn in a little, so that a face on a voxel's border stays on its own side
        inner = vertices - low + (shape * voxel - size) / 2 - TUNING.rounding_voxels * voxel * normals
        mesh = open3d.geometry.TriangleMesh(
            open3d.utility.Vector3dVector(inner), open3d.utility.Vector3iVector(body.solid_faces)
        )
        grid = open3d.geometry.VoxelGrid.create_from_triangle_mesh_within_bounds(
            mesh, voxel, np.zeros(3), shape * voxel
        )
        index = np.array([v.grid_index for v in grid.get_voxels()]).reshape(-1, 3)
        scene = open3d.t.geometry.RaycastingScene()
        scene.add_triangles(open3d.t.geometry.TriangleMesh.from_legacy(mesh))
        middles = (voxel * (np.stack(np.indices(shape), -1) + 0.5)).astype(np.float32)
        voxels = scene.compute_occupancy(open3d.core.Tensor(middles), nsamples=3).numpy() > 0
        voxels[tuple(np.clip(index, 0, shape - 1).T)] = True
        return cls(rotation, voxels, (shape * voxel - size) / 2 - low)

    @classmethod
    def filling(cls, grid: Grid, half: np.ndarray, rotation: np.ndarray, voxel: float) -> Turned:
        """The voxels whose middle lies where a body's grid is negative; half `(3,)` of the body's box."""
        from ..kernels.grid import negative

        shape = np.maximum(np.ceil(2 * np.abs(rotation) @ half / voxel).astype(int), 1)
        first = rotation.T @ ((0.5 - shape / 2) * voxel)
        voxels = np.empty(tuple(shape), np.bool_)
        negative(grid.values, rotation.T * (voxel / grid.spacing), (first - grid.origin) / grid.spacing, voxels)
        return cls(rotation, voxels, shape * voxel / 2)

    def turned(self, quarter: np.ndarray, voxel: float) -> Turned:
        """The same after one of `quarter_turns`: the voxels change places with their axes."""
        axes, signs = np.abs(quarter).argmax(1), quarter.sum(1)
        backwards = tuple(int(axis) for axis in np.flatnonzero(signs < 0))
        voxels = np.ascontiguousarray(np.flip(self.voxels.transpose(axes), backwards))
        centre = np.where(signs < 0, np.array(voxels.shape) * voxel - self.centre[axes], self.centre[axes])
        return Turned(quarter @ self.rotation, voxels, centre)


def straight(body: Body, voxel: float, make: Callable[[Body, np.ndarray, float], Turned]) -> Iterable[Turned]:
    """A body in its quarter turns, or in those that are wished of it.

    make : its voxels, turned by a rotation, such as `Turned.covering`.
    """
    if body.wishes.turns is not None:
        return (make(body, turn, voxel) for turn in body.wishes.turns.straight())
    unturned = make(body, np.eye(3), voxel)
    return (unturned.turned(turn, voxel) for turn in quarter_turns())


class Room:
    """A container in voxels and what has been placed in it; voxel (0, 0, 0) begins at `origin`.

    taken `(X, Y, Z)` bool. margin : in voxels, how deep inside a mesh container a voxel's middle must lie to be free.
    """

    def __init__(self, container: Container, voxel: float, margin: float = 3**0.5 / 2):
        low, high = container.bounds
        self.voxel = voxel
        self.shape = np.maximum(np.floor((high - low) / voxel + TUNING.rounding_voxels).astype(int), 1)
        self.origin = (low + high) / 2 - self.shape * voxel / 2
        self.walls = np.zeros(self.shape, bool)
        if container.base.size is None:
            points = torch.from_numpy(self._middles([slice(None)] * 3).reshape(-1, 3))
            distance = container.base.signed_distance(points)[0].numpy().reshape(self.shape)
            self.walls = distance > -voxel * margin
        for zone in container.zones:
            first, last = ((corner - self.origin) / voxel for corner in Container(zone).bounds)
            near = [slice(max(0, int(a) - 2), max(0, int(b) + 3)) for a, b in zip(first, last, strict=True)]
            if self.walls[tuple(near)].size:
                self.walls[tuple(near)] |= distance_to(zone, self._middles(near)) < voxel * margin
        self.padded = [fft.next_fast_len(int(n), real=True) for n in self.shape]
        self.threads = -1 if self.shape.prod() > TUNING.threaded_from_voxels else 1
        self.clear()

    def _middles(self, voxels: Sequence[slice]) -> np.ndarray:
        """`(X, Y, Z, 3)` metres, of some voxels."""
        axes = [self.origin[k] + self.voxel * (np.arange(self.shape[k])[some] + 0.5) for k, some in enumerate(voxels)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), -1)

    def clear(self, taken: np.ndarray | None = None) -> None:
        """Empty the container, or fill it with `taken`."""
        self.taken = self.walls.copy() if taken is None else self.walls | taken
        self._spectra: dict[str, np.ndarray] = {}

    def place(self, turned: Turned, shift: np.ndarray) -> None:
        """Fill an object's voxels, its first at `shift` `(3,)`."""
        filled = tuple(slice(s, s + n) for s, n in zip(shift, turned.voxels.shape, strict=True))
        self.taken[filled] |= turned.voxels
        self._spectra = {}

    def centre(self, turned: Turned, shift: np.ndarray) -> np.ndarray:
        """Where the centre of an object placed at `shift` lies, `(3,)` world."""
        return self.origin + shift * self.voxel + turned.centre

    def holds(self, turns: Iterable[Turned]) -> bool:
        """Whether one of the turns has a place where it shares nothing."""
        return any(
            not self.taken.any() or (self._correlate("taken", item)[valid] < 0.5).any()
            for _, item, valid in self._items(turns)
        )

    def snuggest(self, turns: Iterable[Turned]) -> tuple[Turned, np.ndarray] | None:
        """The turn and shift that share nothing and lie nearest to what is there; None if nothing fits."""
        found, least = None, np.inf
        for turned, item, valid in self._items(turns):
            free = self._correlate("taken", item)[valid] < 0.5
            if not free.any():
                continue
            height = TUNING.floor_bias_voxels * (np.arange(free.shape[2]) / self.shape[2]) ** 3
            cost = np.where(free, self._correlate("distance", item)[valid] / turned.voxels.sum() + height, np.inf)
            at = int(cost.argmin())
            if cost.flat[at] < least:
                found, least = (turned, np.array(np.unravel_index(at, free.shape))), cost.flat[at]
        return found

    def deepest(self, turns: Iterable[Turned]) -> tuple[Turned, np.ndarray] | None:
        """The turn and shift that share nothing and whose box's middle lies lowest, then least far along y, then x."""
        found, least = None, (np.inf,)
        for turned, item, valid in self._items(turns):
            free = (self._correlate("taken", item)[valid] < 0.5).transpose(2, 1, 0)
            if free.any():
                shift = np.array(np.unravel_index(int(free.argmax()), free.shape))[::-1]
                middle = tuple((shift + np.array(turned.voxels.shape) / 2)[::-1])
                if middle < least:
                    found, least = (turned, shift), middle
        return found

    def flattest(self, turns: Iterable[Turned]) -> tuple[Turned, np.ndarray] | None:
        """The turn and shift, dropped from above, that raise the heights of what is there least in the sum."""
        heights = self._heights()
        found, least = None, np.inf
        for turned, item, valid in self._items(turns):
            free = self._correlate("taken", item)[valid] < 0.5
            columns = turned.voxels.any(2)
            low = turned.voxels.argmax(2)[columns]
            high = turned.voxels.shape[2] - turned.voxels[:, :, ::-1].argmax(2)[columns]
            under = np.lib.stride_tricks.sliding_window_view(heights, columns.shape)[:, :, columns]
            landing = (under - low).max(2).clip(0)
            corner = TUNING.corner_bias_voxels * np.indices(landing.shape).sum(0)
            raised = (landing[..., None] + high - under).sum(2) + corner
            lands = landing < free.shape[2]
            lands[lands] = free[(*np.nonzero(lands), landing[lands])]
            cost = np.where(lands, raised, np.inf)
            at = np.unravel_index(int(cost.argmin()), cost.shape)
            if cost[at] < least:
                found, least = (turned, np.array([*at, landing[at]])), cost[at]
        return found

    def _heights(self) -> np.ndarray:
        """`(X, Y)`: the first voxel above the floor and all that was placed; the room's height where all is wall."""
        top = self.shape[2]
        floor = np.where(self.walls.all(2), top, (~self.walls).argmax(2))
        placed = self.taken & ~self.walls
        return np.where(placed.any(2), top - placed[:, :, ::-1].argmax(2), floor)

    def least_shared(self, turns: Iterable[Turned]) -> tuple[Turned, np.ndarray, float] | None:
        """The turn and shift that share least with what is there, and the shared volume in cubic metres."""
        found, least = None, np.inf
        for turned, item, valid in self._items(turns):
            shared = self._correlate("taken", item)[valid]
            at = int(shared.argmin())
            if shared.flat[at] < least:
                found, least = (turned, np.array(np.unravel_index(at, shared.shape))), float(shared.flat[at])
        return None if found is None else (*found, max(least, 0.0) * self.voxel**3)

    def _items(self, turns: Iterable[Turned]):
        """Each turn that is no larger than the room, its spectrum, and the shifts at which it lies within."""
        for turned in turns:
            size = turned.voxels.shape
            if turned.voxels.any() and all(s <= n for s, n in zip(size, self.shape, strict=True)):
                valid = tuple(slice(0, n - s + 1) for s, n in zip(size, self.shape, strict=True))
                yield turned, np.conj(self._transform(turned.voxels)), valid

    def _transform(self, field: np.ndarray) -> np.ndarray:
        return fft.rfftn(field.astype(np.float32), self.padded, workers=self.threads)

    def _correlate(self, what: str, item: np.ndarray) -> np.ndarray:
        if what not in self._spectra:
            field = self.taken
            if what == "distance":
                field = ndimage.distance_transform_edt(np.pad(~self.taken, 1))[1:-1, 1:-1, 1:-1]
            self._spectra[what] = self._transform(field)
        return fft.irfftn(self._spectra[what] * item, self.padded, workers=self.threads)
