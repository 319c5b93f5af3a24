"""Objects added where they hide from one view what another view shows too, so that no two pictures claim one surface.

What two views see has one colour, and two pictures to match: they dispute it. An object before such a surface ends the
dispute, if it is itself seen by one view alone. Greedy as `greedy_cover`, with the difference of the pictures' colours
for what is open, and what views see found by rays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..util import o3d
from .greedy_cover import Covering


@dataclass(frozen=True)
class OccluderSettings:
    """candidates : places looked at for each object that is added. attempts : drawings of candidates before the search
    ends. least_gain_of_dark : the dispute that an object must end, in pixels of difference 1, as a fraction of a
    picture's dark pixels. wanted_worth, spilled_worth : of a pixel that becomes dark, if it should be and if not.
    reach_radii : how far before a surface candidates are drawn, and spread_radii, how far they scatter, in mean radii
    of the objects. skin_widths : how far before a surface it is asked if another view sees it, in widths of the volume.
    """

    candidates: int = 2000
    attempts: int = 8
    least_gain_of_dark: float = 2e-5
    wanted_worth: float = 0.1
    spilled_worth: float = -1.0
    reach_radii: float = 4.0
    spread_radii: float = 0.4
    skin_widths: float = 1e-3


SETTINGS = OccluderSettings()


def add_occluders(covering: Covering, colours: np.ndarray, count: int) -> float:
    """Add up to `count` objects, while one ends some dispute; returns what is left of it, the mean square difference of
    each pixel of the worst view from its picture if disputed surfaces get the mean colour.

    colours `(K, H, H, 3)` in [0, 1] of the pictures, with the covering's pixels.
    """
    shared = _shared(covering) * _difference(colours, covering.wanted)
    least_gain = SETTINGS.least_gain_of_dark * covering.wanted.sum((1, 2)).mean()
    visible = _Visible(covering, colours)
    for _ in range(count):
        if not any(_add(covering, visible, shared, least_gain) for _ in range(SETTINGS.attempts)):
            break
        visible = _Visible(covering, colours)
    return visible.left


class _Visible:
    """What the views see: depth `(K, H, H)` along the middle ray, inf where nothing; points `(K, H, H, 3)`; dispute
    `(K, H, H)`, a quarter of the square difference to the other pictures where their views see the same."""

    def __init__(self, covering: Covering, colours: np.ndarray):
        open3d = o3d.load()
        bodies = [covering.pool[index] for index in covering.chosen]
        poses = zip(bodies, covering.rotation, covering.translation, strict=True)
        caster = o3d.caster(
            (b.solid_vertices @ rotation.T + translation, b.solid_faces) for b, rotation, translation in poses
        )
        size, cameras = covering.size, covering.cameras
        self.depth, self.points = np.full((len(cameras), size, size), np.inf), np.zeros((len(cameras), size, size, 3))
        for k, camera in enumerate(cameras):
            origins, directions = camera.rays(size)
            rays = open3d.core.Tensor(np.concatenate([origins, directions], -1).astype(np.float32))
            distance = caster.cast_rays(rays)["t_hit"].numpy()
            seen = np.isfinite(distance)
            self.points[k][seen] = origins[seen] + directions[seen] * distance[seen, None]
            self.depth[k][seen] = self.points[k][seen] @ camera.axes[2]
        self.dispute = np.zeros((len(cameras), size, size))
        for k in range(len(cameras)):
            seen = np.isfinite(self.depth[k])
            points = self.points[k][seen]
            for other, camera in enumerate(cameras):
                if other != k:
                    row, column = (x.clip(0, size - 1) for x in camera.pixels(points, size))
                    back = camera.eye[:3] - camera.eye[3] * points
                    rays = np.concatenate([points, back / np.linalg.norm(back, axis=1, keepdims=True)], 1)
                    lines = open3d.core.Tensor(rays.astype(np.float32))
                    free = ~caster.test_occlusions(lines, tnear=SETTINGS.skin_widths * camera.width).numpy()
                    gap = ((colours[k][seen] - colours[other, row, column]) ** 2).mean(-1)
                    self.dispute[k][seen] += np.where(free, gap / 4, 0)
        self.left = float((self.dispute.sum((1, 2)) / np.isfinite(self.depth).sum((1, 2)).clip(1)).max())


def _add(covering: Covering, visible: _Visible, shared: np.ndarray, least_gain: float) -> bool:
    from ..kernels.greedy_cover import Occlusion

    weight, random, count = visible.dispute.ravel(), covering.random, SETTINGS.candidates
    if not weight.any():
        return False
    radius = float(np.mean([body.radius for body in covering.pool]))
    drawn = np.searchsorted(weight.cumsum(), random.random(count) * weight.sum(), side="right")
    toward = np.stack([c.axes[2] for c in covering.cameras])[random.integers(len(covering.cameras), size=count)]
    candidates = visible.points.reshape(-1, 3)[drawn]
    candidates -= SETTINGS.reach_radii * radius * random.random((count, 1)) * toward
    candidates += SETTINGS.spread_radii * radius * random.normal(size=candidates.shape)
    candidates = candidates[_within(covering, candidates)]
    if not len(candidates):
        return False
    worth = np.where(covering.wanted, SETTINGS.wanted_worth, SETTINGS.spilled_worth)
    # what one view no longer sees is no longer disputed in the other either
    occlusion = Occlusion(hidden=2 * visible.dispute, depth=visible.depth, shared=shared)
    return covering.add_best(candidates, np.where(covering.dark, 0.0, worth), least_gain, occlusion)


def _within(covering: Covering, places: np.ndarray) -> np.ndarray:
    """Which places `(P, 3)` no object is too large for to lie within every picture: beyond, a view counts no shadow."""
    radius, inside = max(body.radius for body in covering.pool), np.ones(len(places), bool)
    for camera in covering.cameras:
        edge = np.ceil(radius / camera.width * covering.size)
        for at in camera.pixels(places, covering.size):
            inside &= (at >= edge) & (at < covering.size - edge)
    return inside


def _shared(covering: Covering) -> np.ndarray:
    """`(L, K, K)`: for each silhouette and two views that see all of it, a b / (a + b) summed over the faces that both
    see, a and b their areas as seen: the least squares left by one colour for two pictures of difference 1."""
    forward = np.stack([camera.axes[2] for camera in covering.cameras])
    found = []
    for b, body in enumerate(covering.pool):
        turns = covering.profiles.rotation[b * covering.profiles.turns : (b + 1) * covering.profiles.turns]
        corners = body.solid_vertices[body.solid_faces]
        area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
        facing = np.maximum(-np.einsum("ki,tij,fj->tkf", forward, turns, area), 0)
        first, second = facing[:, :, None], facing[:, None]
        found.append((first * second / np.maximum(first + second, 1e-30)).sum(-1))
    return np.concatenate(found)


def _difference(colours: np.ndarray, wanted: np.ndarray) -> float:
    """The mean square difference between a dark pixel of one picture and one of another."""
    dark = [picture[inside] for picture, inside in zip(colours, wanted, strict=True)]
    pairs = [(a, b) for k, a in enumerate(dark) for b in dark[:k]]
    return float(np.mean([((a.mean(0) - b.mean(0)) ** 2 + a.var(0) + b.var(0)).mean() for a, b in pairs]))
