"""Objects added one by one where their silhouettes cover most of what is still open in all pictures, and spill least.

Greedy, on pixels: one that should be dark and is not yet is worth 1, one that should stay light costs 1. Candidates are
drawn in the visual hull where pictures are still open. The best of those that touch nothing climb to where they gain
most, touching nothing; the best is added. What the silhouettes cost keeps bodies in the hull; nothing else has to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from ..geometry.cameras import PERSPECTIVE_DISTANCE, Camera
from ..geometry.meshes import Body
from ..geometry.sdf import GridStack
from ..geometry.silhouette_edges import Outlines, Views
from ..geometry.surface_samples import surface_samples
from ..poses import Poses
from ..silhouettes import likeness, mask
from .run_length import Profiles


@dataclass(frozen=True)
class CoverSettings:
    """turns : random turns of each object. candidates : places looked at for each object that is added. climbed : of
    them, the best, that climb. attempts : drawings of candidates before the search ends. lattice : points along an edge
    of the viewing volume that may lie in the hull. margin_widths : kept between bodies, in widths of the volume."""

    turns: int = 32
    candidates: int = 3000
    climbed: int = 8
    attempts: int = 8
    first_step_px: float = 8.0
    last_step_px: float = 0.5
    lattice: int = 128
    margin_widths: float = 5e-4


SETTINGS = CoverSettings()


class Covering:
    """Objects of a pool, each as often as is wanted, before K views, and what they leave open.

    chosen, rotation, translation : indices into the pool, and poses, of what was added. wanted `(K, H, H)` bool: the
    pixels that should be dark. dark `(K, H, H)` bool: those that are.
    """

    def __init__(self, pool: Sequence[Body], cameras: Sequence[Camera], wanted: np.ndarray, seed: int):
        """cameras about the origin; `reset` sets the width of the smallest, and the others' in proportion."""
        from ..kernels import greedy_cover

        self._kernels = greedy_cover
        self.pool, self.wanted = list(pool), np.asarray(wanted, bool)
        self._seed, self.size = seed, self.wanted.shape[-1]
        self.profiles = Profiles.of(pool, cameras, SETTINGS.turns, seed)
        samples = surface_samples(pool)
        self._solids = greedy_cover.Solids(
            grids=GridStack.of_bodies(pool).arrays,
            points=samples.points.numpy(),
            first=np.append(samples.start.numpy(), len(samples.points)),
            radius=np.array([body.radius for body in pool]),
        )
        self._silhouettes = greedy_cover.Silhouettes(
            runs=self.profiles.runs,
            rotation=self.profiles.rotation,
            half_extents=self.profiles.half_extents,
            radius=self.profiles.radius,
        )
        least = min(camera.width for camera in cameras)
        self._at_width_1 = [replace(camera, width=camera.width / least) for camera in cameras]
        self._points, self._pixels = hull_points(self.wanted, self._at_width_1)
        self.reset(1.0)

    def reset(self, width: float) -> None:
        """Take all objects away, and set the least width of the views, that of the viewing volume, metres. Raises
        InputError for one that is not positive."""
        self.random = np.random.default_rng([5, self._seed])
        self.cameras = [replace(camera, width=width * camera.width) for camera in self._at_width_1]
        self.chosen, self.rotation, self.translation = [], np.zeros((0, 3, 3)), np.zeros((0, 3))
        self.dark = np.zeros_like(self.wanted)

    @property
    def width(self) -> float:
        """Of the viewing volume, metres."""
        return min(camera.width for camera in self.cameras)

    @property
    def poses(self) -> Poses:
        """Of what was added."""
        return Poses(torch.from_numpy(self.rotation), torch.from_numpy(self.translation))

    @property
    def likeness(self) -> np.ndarray:
        """`(K,)` intersection over union of what is dark with what should be."""
        return likeness(self.dark, self.wanted)

    def set_bodies(self, chosen: Sequence[int], poses: Poses) -> None:
        """Have these objects at these poses instead."""
        self.chosen = list(chosen)
        self.rotation, self.translation = poses.rotation.double().numpy(), poses.translation.double().numpy()
        self.dark = self._drawn(self.chosen, self.rotation, self.translation)

    def fill(self, count: int, least_gain: float) -> int:
        """Add up to `count` objects, while one gains `least_gain` pixels; returns how many."""
        for done in range(count):
            if not any(self._add_where_open(least_gain) for _ in range(SETTINGS.attempts)):
                return done
        return count

    def add_best(self, candidates: np.ndarray, worth: np.ndarray, least_gain: float, occlusion=None) -> bool:
        """Add one object at the best of `candidates` `(M, 3)`, in a random turn each, and of what is near them.

        worth `(K, H, H)`: of each pixel that it covers. occlusion : what else it is worth to hide what the views see, a
        `kernels.greedy_cover.Occlusion`. Returns False if no free place gains `least_gain`.
        """
        kernels, profiles, pixel = self._kernels, self.profiles, self.width / self.size
        scene = kernels.Scene(
            views=view_arrays(self.cameras),
            silhouettes=self._silhouettes,
            worth=np.concatenate([np.zeros((*worth.shape[:2], 1)), worth.cumsum(2)], 2),
            occlusion=occlusion or kernels.NO_OCCLUSION,
        )
        obstacles = kernels.Obstacles(
            bounds=np.array([[-0.5] * 3, [0.5] * 3]) * self.width,
            solids=self._solids,
            body=np.array(self.chosen, np.int64),
            rotation=self.rotation,
            translation=self.translation,
            margin=SETTINGS.margin_widths * self.width,
        )
        which = self.random.integers(len(profiles.runs), size=len(candidates))
        found = kernels.gains(scene, obstacles.bounds, which, candidates)
        best, best_gain, climbed = None, least_gain, 0
        for m in np.argsort(-found):
            if climbed == SETTINGS.climbed or not np.isfinite(found[m]):
                break
            if kernels.is_free(obstacles, which[m] // profiles.turns, profiles.rotation[which[m]], candidates[m]):
                climbed, at = climbed + 1, candidates[m].copy()
                index, gain = kernels.climb(
                    scene,
                    obstacles,
                    turns=profiles.turns,
                    which=which[m],
                    at=at,
                    first_step=SETTINGS.first_step_px * pixel,
                    last_step=SETTINGS.last_step_px * pixel,
                )
                if gain >= best_gain:
                    best, best_gain = (index, at), gain
        if best is None:
            return False
        index, at = best
        self._add(index // profiles.turns, profiles.rotation[index], at)
        return True

    def _add_where_open(self, least_gain: float) -> bool:
        open_ = (self.wanted & ~self.dark).reshape(len(self.wanted), -1)
        weight = np.sum([row[at] for row, at in zip(open_, self._pixels, strict=True)], 0) ** 2.0
        if not weight.any():
            return False
        chance = self.random.random(SETTINGS.candidates)
        drawn = np.searchsorted(weight.cumsum(), chance * weight.sum(), side="right")
        worth = np.where(self.dark, 0.0, np.where(self.wanted, 1.0, -1.0))
        return self.add_best(self._points[drawn] * self.width, worth, least_gain)

    def _add(self, body: int, rotation: np.ndarray, translation: np.ndarray) -> None:
        self.chosen.append(int(body))
        self.rotation = np.concatenate([self.rotation, rotation[None]])
        self.translation = np.concatenate([self.translation, translation[None]])
        self.dark |= self._drawn([body], rotation[None], translation[None])

    def _drawn(self, chosen: Sequence[int], rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
        """Hard silhouettes `(K, H, H)` bool."""
        if not len(chosen):
            return np.zeros_like(self.wanted)
        outlines = Outlines([self.pool[i] for i in chosen])
        rotation, translation = torch.from_numpy(rotation).float(), torch.from_numpy(translation).float()
        return mask(outlines, rotation, translation, Views(self.cameras), self.size).numpy()


def hull_points(wanted: np.ndarray, cameras: Sequence[Camera]) -> tuple[np.ndarray, np.ndarray]:
    """Points `(M, 3)` of a lattice in the viewing volume that are dark in all pictures `(K, H, H)` bool, and the number
    of the pixel that shows each of them, `(K, M)`, row by row."""
    size = wanted.shape[-1]
    steps = ((np.arange(SETTINGS.lattice) + 0.5) / SETTINGS.lattice - 0.5) * min(camera.width for camera in cameras)
    points = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1).reshape(-1, 3) + cameras[0].centre
    pixels = np.zeros((0, len(points)), np.int64)
    for camera, picture in zip(cameras, wanted, strict=True):
        row, column = camera.pixels(points, size)
        seen = (column >= 0) & (column < size) & (row >= 0) & (row < size)
        seen[seen] = picture[row[seen], column[seen]]
        points, pixels = points[seen], np.vstack([pixels[:, seen], (row * size + column)[seen]])
    return points, pixels


def view_arrays(cameras: Sequence[Camera]):
    """The cameras for the compiled loops, as `kernels.greedy_cover.Views`."""
    from ..kernels.greedy_cover import Views as Arrays

    distance = [PERSPECTIVE_DISTANCE * c.width if c.projection == "perspective" else 0.0 for c in cameras]
    return Arrays(
        axes=np.stack([camera.axes for camera in cameras]),
        centre=np.array([camera.centre for camera in cameras], float),
        width=np.array([camera.width for camera in cameras]),
        distance=np.array(distance),
    )
