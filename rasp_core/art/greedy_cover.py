"""Objects put one by one where their silhouettes cover most of what is still open in all pictures, and spill least.

Greedy, on pixels: one that should be dark and is not yet is worth 1, one that should stay light costs 1. Places are
drawn in the visual hull where pictures are still open; the best of those that touch nothing climb to where they gain
most, touching nothing; the best is taken. What the silhouettes cost keeps bodies in the hull; nothing else has to.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

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

TURNS = 32  # of each object
DRAWN = 3000  # places looked at for each object that is put
CLIMBED = 8  # of them, the best, that climb
ATTEMPTS = 8  # drawings before it is taken that nothing can be put
STEPS = (8.0, 0.5)  # pixels: the first and the last step of a climb
DEPTHS = 128  # points along an edge of the viewing volume that may lie in the hull
MARGIN = 5e-4  # of the viewing volume's edge, kept between bodies


class Covering:
    """Objects of a pool, each as often as is wanted, before K views of one width, and what they leave open.

    chosen, rotation, place : indices into the pool, and poses, of what is placed. wanted `(K, H, H)` bool: the pixels
    that should be dark. dark `(K, H, H)` bool: those that are.
    """

    def __init__(self, pool: Sequence[Body], cameras: Sequence[Camera], wanted: np.ndarray, seed: int):
        """cameras about the origin; `begin` sets their width."""
        from ..kernels import greedy_cover

        self._kernels = greedy_cover
        self.pool, self.wanted = list(pool), np.asarray(wanted, bool)
        self._seed, self.size = seed, self.wanted.shape[-1]
        self.profiles = Profiles.of(pool, cameras, TURNS, seed)
        samples = surface_samples(pool)
        self._solids = (
            GridStack.of_bodies(pool).arrays,
            (samples.points.numpy(), np.append(samples.start.numpy(), len(samples.points))),
            np.array([body.radius for body in pool]),
        )
        self._at_width_1 = [replace(camera, width=1.0) for camera in cameras]
        self._points, self._pixels = hull_points(self.wanted, self._at_width_1)
        self.begin(1.0)

    def begin(self, width: float) -> None:
        """Take all objects away, and set the views' width, metres."""
        self.random = np.random.default_rng([5, self._seed])
        self.cameras = [replace(camera, width=width) for camera in self._at_width_1]
        self.chosen, self.rotation, self.place = [], np.zeros((0, 3, 3)), np.zeros((0, 3))
        self.dark = np.zeros_like(self.wanted)

    @property
    def width(self) -> float:
        """Of the viewing volume, metres."""
        return self.cameras[0].width

    @property
    def start(self) -> Poses:
        """The poses of what is placed."""
        return Poses(torch.from_numpy(self.rotation), torch.from_numpy(self.place))

    @property
    def likeness(self) -> np.ndarray:
        """`(K,)` intersection over union of what is dark with what should be."""
        return likeness(self.dark, self.wanted)

    def take(self, chosen: Sequence[int], start: Poses) -> None:
        """Have these objects at these poses instead."""
        self.chosen = list(chosen)
        self.rotation, self.place = start.rotation.double().numpy(), start.translation.double().numpy()
        self.dark = self._drawn(self.chosen, self.rotation, self.place)

    def fill(self, count: int, least: float, ends: Callable[[], bool] = lambda: False) -> int:
        """Put up to `count` objects more, while one gains `least` pixels and `ends` is false; returns how many."""
        for done in range(count):
            if ends() or not any(self._put_where_open(least) for _ in range(ATTEMPTS)):
                return done
        return count

    def put(self, places: np.ndarray, worth: np.ndarray, least: float, veil: tuple | None = None) -> bool:
        """Put one object at the best of `places` `(M, 3)`, in a random turn each, and of what is near them.

        worth `(K, H, H)`: of each pixel that it covers. veil : (hidden, depth, shared), see `kernels_covering`. Returns
        False where no free place gains `least`.
        """
        profiles, margin, pixel = self.profiles, MARGIN * self.width, self.width / self.size
        bounds = np.array([[-0.5] * 3, [0.5] * 3]) * self.width
        sums = np.concatenate([np.zeros((*worth.shape[:2], 1)), worth.cumsum(2)], 2)
        arrays = profiles.runs, profiles.rotation, profiles.reach, profiles.radius
        scene = _arrays(self.cameras), arrays, sums, veil or (np.zeros((0, 0, 0)),) * 3
        which, found = self.random.integers(len(profiles.runs), size=len(places)), np.empty(len(places))
        self._kernels.gains(scene, bounds, which, places, found)
        placed = np.array(self.chosen, np.int64), self.rotation, self.place
        best, climbed = (least, 0, None), 0
        for m in np.argsort(-found):
            body, turn, place = which[m] // profiles.turns, profiles.rotation[which[m]], places[m].copy()
            if climbed == CLIMBED or not np.isfinite(found[m]):
                break
            if self._kernels.free(self._solids, placed, body, turn, place, margin):
                steps, climbed = (step * pixel for step in STEPS), climbed + 1
                solids = bounds, self._solids, placed, margin
                index, value = self._kernels.climb(scene, *solids, profiles.turns, which[m], place, *steps)
                best = (value, index, place) if value >= best[0] else best
        _, index, place = best
        if place is None:
            return False
        self._add(index // profiles.turns, profiles.rotation[index], place)
        return True

    def _put_where_open(self, least: float) -> bool:
        open_ = (self.wanted & ~self.dark).reshape(len(self.wanted), -1)
        weight = np.sum([row[at] for row, at in zip(open_, self._pixels, strict=True)], 0) ** 2.0
        if not weight.any():
            return False
        drawn = np.searchsorted(weight.cumsum(), self.random.random(DRAWN) * weight.sum(), side="right")
        worth = np.where(self.dark, 0.0, np.where(self.wanted, 1.0, -1.0))
        return self.put(self._points[drawn] * self.width, worth, least)

    def _add(self, body: int, turn: np.ndarray, place: np.ndarray) -> None:
        self.chosen.append(int(body))
        self.rotation = np.concatenate([self.rotation, turn[None]])
        self.place = np.concatenate([self.place, place[None]])
        self.dark |= self._drawn([body], turn[None], place[None])

    def _drawn(self, chosen: Sequence[int], rotation: np.ndarray, place: np.ndarray) -> np.ndarray:
        """Hard silhouettes `(K, H, H)` bool."""
        if not len(chosen):
            return np.zeros_like(self.wanted)
        pose = torch.from_numpy(rotation).float(), torch.from_numpy(place).float()
        return mask(Outlines([self.pool[i] for i in chosen]), *pose, Views(self.cameras), self.size).numpy()


def hull_points(wanted: np.ndarray, cameras: Sequence[Camera]) -> tuple[np.ndarray, np.ndarray]:
    """Points `(M, 3)` of a lattice in the viewing volume that are dark in all pictures `(K, H, H)` bool, and the number
    of the pixel that shows each of them, `(K, M)`, row by row."""
    size, steps = wanted.shape[-1], ((np.arange(DEPTHS) + 0.5) / DEPTHS - 0.5) * cameras[0].width
    points = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1).reshape(-1, 3) + cameras[0].centre
    pixels = np.zeros((0, len(points)), np.int64)
    for camera, picture in zip(cameras, wanted, strict=True):
        row, column = camera.pixels(points, size)
        seen = (column >= 0) & (column < size) & (row >= 0) & (row < size)
        seen[seen] = picture[row[seen], column[seen]]
        points, pixels = points[seen], np.vstack([pixels[:, seen], (row * size + column)[seen]])
    return points, pixels


def _arrays(cameras: Sequence[Camera]) -> tuple[np.ndarray, ...]:
    """Views for the compiled loops, see `kernels_covering`."""
    distance = [PERSPECTIVE_DISTANCE * c.width if c.projection == "perspective" else 0.0 for c in cameras]
    axes, centre = np.stack([c.axes for c in cameras]), np.array([c.centre for c in cameras], float)
    return axes, centre, np.array([c.width for c in cameras]), np.array(distance)
