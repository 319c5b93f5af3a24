"""Colours for a heap, such that each view's picture of it is the one that was asked for.

Each pixel of a view sees one point of one triangle, found by a ray, and that point's colour is the mean of three texels
by their weights. All pixels of all views are one sparse linear system in the texels' colours; the least squares
solution that is also smooth along the surfaces (a Laplacian, lightly weighted) settles what views dispute, and carries
colours on to what no view sees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import cg
from scipy.spatial import cKDTree

from ..geometry.cameras import Camera
from ..geometry.meshes import Body
from ..util import o3d
from ..util.errors import InputError
from .texture_atlas import Atlas

if TYPE_CHECKING:
    from .sculpture import Sculpture


@dataclass(frozen=True)
class PaintSettings:
    """texel_px : pixels between texels. rays : along a pixel's edge; with one, colours alternate between what two views
    chance to hit. largest_steps : texels along a triangle's edge. smoothness : weight of a difference of neighbouring
    texels against a pixel's. seam_neighbours : across the triangles' edges, that a texel there is tied to. tolerance,
    iterations : of the conjugate gradients, which begin at `grey`."""

    texel_px: float = 1.6
    rays: int = 2
    largest_steps: int = 40
    smoothness: float = 3e-2
    seam_neighbours: int = 2
    tolerance: float = 1e-3
    iterations: int = 300
    grey: float = 0.5


SETTINGS = PaintSettings()


@dataclass(frozen=True)
class Painted:
    """A heap's surfaces and their colours.

    corners `(F, 3, 3)`: of the bodies' triangles, body by body, in their files' frames; first `(N + 1,)`: each body's.
    atlas, colours `(T, 3)` in [0, 1]: their texture. images `(K, H, H, 3)`: what the views see, else white; seen
    `(K, H, H)` bool: where something. pictures `(K, H, H, 3)`: what was asked for.
    """

    corners: np.ndarray
    first: np.ndarray
    atlas: Atlas
    colours: np.ndarray
    images: np.ndarray
    seen: np.ndarray
    pictures: np.ndarray

    @cached_property
    def psnr(self) -> np.ndarray:
        """`(K,)` peak signal to noise ratio in decibels of each view, inside the heap's silhouette."""
        errors = zip(self.images - self.pictures, self.seen, strict=True)
        return np.array([-10 * np.log10(max((error[seen] ** 2).mean(), 1e-12)) for error, seen in errors])

    @cached_property
    def ssim(self) -> np.ndarray:
        """`(K,)` structural similarity (Wang et al. 2004) of each view, inside the heap's silhouette."""
        from skimage.metrics import structural_similarity

        alike = []
        for image, picture, seen in zip(self.images, self.pictures, self.seen, strict=True):
            full = structural_similarity(image, picture, channel_axis=2, data_range=1.0, full=True)[1]
            alike.append(full.mean(2)[seen].mean())
        return np.array(alike)


def paint(sculpture: Sculpture, colours: np.ndarray) -> Painted:
    """Colours for a sculpture, by least squares; `colours` `(K, H, H, 3)` in [0, 1] of its pictures, of any resolution.

    Raises InputError for another shape.
    """
    size = np.shape(colours)[1] if np.ndim(colours) == 4 else sculpture.pictures.shape[-1]
    return Canvas(sculpture.bodies, sculpture.matrices, sculpture.cameras, size).paint(colours)


class Canvas:
    """A heap before its views, ready to be painted."""

    def __init__(self, bodies: Sequence[Body], matrices: np.ndarray, cameras: Sequence[Camera], size: int):
        """matrices `(N, 4, 4)` place the bodies' files; size : pixels along an image."""
        placed = [body.placed(matrix)[body.solid_faces] for body, matrix in zip(bodies, matrices, strict=True)]
        self.files = np.concatenate([body.placed(np.eye(4))[body.solid_faces] for body in bodies])
        self.first = np.append(0, np.cumsum([len(triangles) for triangles in placed]))
        self.world, self.cameras, self.size = np.concatenate(placed), list(cameras), size
        faces = np.arange(3 * len(self.world)).reshape(-1, 3)
        self._caster = o3d.caster([(self.world.reshape(-1, 3), faces)])
        self.pixel, face, uv = self._cast(SETTINGS.rays)
        longest = np.linalg.norm(self.world - np.roll(self.world, 1, axis=1), axis=2).max(1)
        steps = np.ones(len(self.world), int)
        steps[face] = (
            np.ceil(longest[face] * size / cameras[0].width / SETTINGS.texel_px)
            .clip(1, SETTINGS.largest_steps)
            .astype(int)
        )
        self.atlas = Atlas.of(steps)
        self.seen_texels = self._weights(face, uv)

    def _cast(self, rays: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of `rays` x `rays` rays for each pixel, those that hit: the pixel, flat into `(K, H, H)`, the triangle, and
        where on it `(P, 2)`."""
        open3d, found = o3d.load(), []
        number = np.arange(rays * self.size) // rays
        pixel = (number[:, None] * self.size + number).ravel()
        for k, camera in enumerate(self.cameras):
            lines = np.concatenate(camera.rays(rays * self.size), -1).astype(np.float32).reshape(-1, 6)
            hit = self._caster.cast_rays(open3d.core.Tensor(lines))
            seen = np.flatnonzero(np.isfinite(hit["t_hit"].numpy()))
            face = hit["primitive_ids"].numpy()[seen].astype(int)
            found.append((pixel[seen] + k * self.size**2, face, hit["primitive_uvs"].numpy()[seen]))
        return tuple(np.concatenate(parts) for parts in zip(*found, strict=True))

    def _weights(self, face: np.ndarray, uv: np.ndarray) -> sparse.csr_matrix:
        """`(P, T)`: what colour each ray hits, from those of the texels."""
        texels, weights = self.atlas.weights(face, *uv.T)
        row = np.repeat(np.arange(len(face)), 3)
        return sparse.csr_matrix((weights.ravel(), (row, texels.ravel())), (len(face), self.atlas.first[-1]))

    def paint(self, pictures: np.ndarray) -> Painted:
        """The colours of least squares for `pictures` `(K, H, H, 3)` in [0, 1]. Raises InputError for other shapes."""
        pictures = self._checked(pictures)
        wanted, ties = pictures.reshape(-1, 3)[self.pixel], self._ties()
        normal = (self.seen_texels.T @ self.seen_texels + SETTINGS.smoothness * (ties.T @ ties)).tocsr()
        diagonal = sparse.diags(1 / np.maximum(normal.diagonal(), 1e-12))
        begin = np.full(normal.shape[0], SETTINGS.grey)
        solve = {"x0": begin, "rtol": SETTINGS.tolerance, "maxiter": SETTINGS.iterations, "M": diagonal}
        colours = np.stack([cg(normal, self.seen_texels.T @ wanted[:, c], **solve)[0] for c in range(3)], 1)
        return self._painted(np.clip(colours, 0, 1), pictures)

    def project(self, pictures: np.ndarray) -> Painted:
        """The naive way: one picture after the other thrown onto what its view sees, the last on top."""
        pictures = self._checked(pictures)
        wanted, colours = pictures.reshape(-1, 3)[self.pixel], np.full((self.seen_texels.shape[1], 3), SETTINGS.grey)
        for k in range(len(self.cameras)):
            rows = np.flatnonzero(self.pixel // self.size**2 == k)
            texels = self.seen_texels[rows]
            total = np.asarray(texels.sum(0)).ravel()
            hit = total > 1e-6
            colours[hit] = (texels.T @ wanted[rows])[hit] / total[hit, None]
        return self._painted(colours, pictures)

    def _checked(self, pictures: np.ndarray) -> np.ndarray:
        pictures, shape = np.asarray(pictures, float), (len(self.cameras), self.size, self.size, 3)
        if pictures.shape != shape:
            raise InputError(f"a picture for each view is needed, {shape}, got {pictures.shape}")
        return pictures

    def _ties(self) -> sparse.csr_matrix:
        """Differences of neighbouring texels, also across the edges of triangles."""
        face, i, j = self.atlas.lattice
        seam = SETTINGS.seam_neighbours
        n = self.atlas.steps[face]
        edge = np.flatnonzero((i == 0) | (j == 0) | (i + j == n))
        u, v = (i[edge] / n[edge])[:, None], (j[edge] / n[edge])[:, None]
        a, b, c = self.world[face[edge]].transpose(1, 0, 2)
        points = a + u * (b - a) + v * (c - a)
        # nearest others lie on the triangle across, at the same place or the next texel
        near = cKDTree(points).query(points, seam + 1)[1]
        seams = np.stack([np.repeat(edge, seam), edge[near[:, 1:].ravel()]], 1)
        pairs = np.concatenate([self.atlas.edges(), seams])
        row = np.repeat(np.arange(len(pairs)), 2)
        values = np.tile([1.0, -1.0], len(pairs))
        return sparse.csr_matrix((values, (row, pairs.ravel())), (len(pairs), self.atlas.first[-1]))

    def _painted(self, colours: np.ndarray, pictures: np.ndarray) -> Painted:
        """Seen by rays other than those that the colours were made for."""
        rays, size = SETTINGS.rays + 1, self.size
        quantised = np.rint(255 * colours) / 255  # as the texture holds them
        count = len(self.cameras) * size**2
        pixel, face, uv = self._cast(rays)
        hits = np.bincount(pixel, minlength=count) / rays**2
        ray = self._weights(face, uv) @ quantised
        sums = np.stack([np.bincount(pixel, ray[:, c], count) for c in range(3)], 1) / rays**2
        images = (sums + (1 - hits)[:, None]).reshape(-1, size, size, 3)
        return Painted(
            corners=self.files,
            first=self.first,
            atlas=self.atlas,
            colours=colours,
            images=images,
            seen=hits.reshape(-1, size, size) > 0.5,
            pictures=pictures,
        )
