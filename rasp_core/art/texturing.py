"""Colours for a heap, such that each view's picture of it is the one that was asked for.

Each pixel of a view sees one point of one triangle, found by a ray, and that point's colour is the mean of three texels
by their weights. All pixels of all views are one sparse linear system in the texels' colours; the least squares
solution that is also smooth along the surfaces (a Laplacian, lightly weighted) settles what views dispute, and carries
colours on to what no view sees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import cg
from scipy.spatial import cKDTree

from ..geometry.cameras import Camera
from ..geometry.meshes import Body
from ..util import o3d
from ..util.errors import InputError
from .texture_atlas import Atlas

FINE = 1.6  # pixels between texels
RAYS = 2  # along a pixel's edge; with one, colours alternate between what two views chance to hit
COARSEST = 40  # steps along a triangle's edge, at most
SMOOTH = 3e-2  # weight of a difference of neighbours against a pixel's
SEAM = 2  # neighbours across the triangles' edges that a texel there is tied to
TOLERANCE, ITERATIONS = 1e-3, 300  # of the conjugate gradients
GREY = 0.5  # to begin with


@dataclass(frozen=True)
class Painted:
    """A heap's surfaces and their colours.

    corners `(F, 3, 3)`: of the bodies' triangles, body by body, in their files' frames; first `(N + 1,)`: each body's.
    atlas, colours `(T, 3)` in [0, 1]: their texture. images `(K, H, H, 3)`: what the views see, else white; seen
    `(K, H, H)` bool: where something.
    """

    corners: np.ndarray
    first: np.ndarray
    atlas: Atlas
    colours: np.ndarray
    images: np.ndarray
    seen: np.ndarray


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
        self.pixel, face, uv = self._look(RAYS)
        longest = np.linalg.norm(self.world - np.roll(self.world, 1, axis=1), axis=2).max(1)
        steps = np.ones(len(self.world), int)
        steps[face] = np.ceil(longest[face] * size / cameras[0].width / FINE).clip(1, COARSEST).astype(int)
        self.atlas = Atlas.of(steps)
        self.sight = self._weights(face, uv)

    def _look(self, rays: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
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
        wanted, ties = self._wanted(pictures), self._ties()
        normal = (self.sight.T @ self.sight + SMOOTH * (ties.T @ ties)).tocsr()
        diagonal = sparse.diags(1 / np.maximum(normal.diagonal(), 1e-12))
        begin = np.full(normal.shape[0], GREY)
        solve = {"x0": begin, "rtol": TOLERANCE, "maxiter": ITERATIONS, "M": diagonal}
        colours = np.stack([cg(normal, self.sight.T @ wanted[:, c], **solve)[0] for c in range(3)], 1)
        return self._painted(np.clip(colours, 0, 1))

    def project(self, pictures: np.ndarray) -> Painted:
        """The naive way: one picture after the other thrown onto what its view sees, the last on top."""
        wanted, colours = self._wanted(pictures), np.full((self.sight.shape[1], 3), GREY)
        for k in range(len(self.cameras)):
            rows = np.flatnonzero(self.pixel // self.size**2 == k)
            sight = self.sight[rows]
            total = np.asarray(sight.sum(0)).ravel()
            hit = total > 1e-6
            colours[hit] = (sight.T @ wanted[rows])[hit] / total[hit, None]
        return self._painted(colours)

    def _wanted(self, pictures: np.ndarray) -> np.ndarray:
        pictures, shape = np.asarray(pictures, float), (len(self.cameras), self.size, self.size, 3)
        if pictures.shape != shape:
            raise InputError(f"a picture for each view is needed, {shape}, got {pictures.shape}")
        return pictures.reshape(-1, 3)[self.pixel]

    def _ties(self) -> sparse.csr_matrix:
        """Differences of neighbouring texels, also across the edges of triangles."""
        face, i, j = self.atlas.lattice
        n = self.atlas.steps[face]
        edge = np.flatnonzero((i == 0) | (j == 0) | (i + j == n))
        u, v = (i[edge] / n[edge])[:, None], (j[edge] / n[edge])[:, None]
        a, b, c = self.world[face[edge]].transpose(1, 0, 2)
        points = a + u * (b - a) + v * (c - a)
        # nearest others lie on the triangle across, at the same place or the next texel
        near = cKDTree(points).query(points, SEAM + 1)[1]
        seams = np.stack([np.repeat(edge, SEAM), edge[near[:, 1:].ravel()]], 1)
        pairs = np.concatenate([self.atlas.edges(), seams])
        row = np.repeat(np.arange(len(pairs)), 2)
        values = np.tile([1.0, -1.0], len(pairs))
        return sparse.csr_matrix((values, (row, pairs.ravel())), (len(pairs), self.atlas.first[-1]))

    def _painted(self, colours: np.ndarray) -> Painted:
        """Seen by rays other than those that the colours were made for."""
        shown = np.rint(255 * colours) / 255  # as the texture holds them
        count = len(self.cameras) * self.size**2
        pixel, face, uv = self._look(RAYS + 1)
        hits = np.bincount(pixel, minlength=count) / (RAYS + 1) ** 2
        ray = self._weights(face, uv) @ shown
        sums = np.stack([np.bincount(pixel, ray[:, c], count) for c in range(3)], 1) / (RAYS + 1) ** 2
        shape = len(self.cameras), self.size, self.size
        images = (sums + (1 - hits)[:, None]).reshape(*shape, 3)
        return Painted(self.files, self.first, self.atlas, colours, images, hits.reshape(shape) > 0.5)


def measure(painted: Painted, pictures: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """PSNR in decibels and SSIM (Wang et al. 2004) of each view inside the heap's silhouette, both `(K,)`."""
    from skimage.metrics import structural_similarity

    noise, alike = [], []
    for image, picture, seen in zip(painted.images, pictures, painted.seen, strict=True):
        noise.append(-10 * np.log10(max(((image - picture)[seen] ** 2).mean(), 1e-12)))
        full = structural_similarity(image, picture.astype(float), channel_axis=2, data_range=1.0, full=True)[1]
        alike.append(full.mean(2)[seen].mean())
    return np.array(noise), np.array(alike)
