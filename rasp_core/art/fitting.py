"""Pictures that may give way: shifted, scaled and turned a little, so that one heap can show them all better.

What is raised is the ceiling, the likeness of the pictures to the silhouettes of their visual hull, in the worst view.
It is found on coarse pictures and a lattice, by steps along one number at a time that become smaller.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import affine_transform

from ..geometry.cameras import Camera
from ..silhouettes import likeness
from ..util.errors import InputError
from .ceiling import hull_silhouettes

COARSE = 96  # pixels along a picture, in the search
LATTICE = 112  # points along an edge of the viewing volume
STEPS = 0.5, 0.25, 0.12, 0.06  # of the bounds
ROUNDS = 3  # at most, with steps of one size
LEAST_GAIN = 5e-4  # of the score, for which a picture is moved
COST = 2e-3  # in the score, of a number that is at its bound
STILL = (0.0, 0.0, 1.0, 0.0)


@dataclass(frozen=True)
class Bounds:
    """How much pictures may give way: shift, of their edge, each way; scale, by one more or less; turn, degrees."""

    shift: float = 0.1
    scale: float = 0.15
    turn_deg: float = 8.0

    def __post_init__(self):
        """Raises InputError for bounds below 0, or that leave nothing of a picture."""
        if not (0 <= self.shift <= 0.5 and 0 <= self.scale <= 0.5 and 0 <= self.turn_deg <= 45):
            raise InputError(
                "pictures may be shifted by 0 to 0.5 of their edge, scaled by 0 to 0.5, and turned by 0 to 45 degrees, "
                f"got {self.shift:g}, {self.scale:g}, {self.turn_deg:g}"
            )


@dataclass(frozen=True)
class Fitted:
    """moves `(K, 4)`: of each picture to the right and up, of its edge; its scale; degrees counter-clockwise. before,
    after `(K,)`: the ceiling."""

    moves: np.ndarray
    before: np.ndarray
    after: np.ndarray

    def apply(self, pictures: np.ndarray) -> np.ndarray:
        """Pictures `(K, H, H)` bool, or `(K, H, H, 3)` float, moved."""
        return np.stack([moved(picture, move) for picture, move in zip(pictures, self.moves, strict=True)])

    def lines(self) -> list[str]:
        """By how much each gave way, and what it was for, in words."""
        found = [
            f"picture {k}: shifted by {100 * right:+.1f} % to the right and {100 * up:+.1f} % up, "
            f"scaled by {scale:.3f}, turned by {turn:+.1f} degrees"
            for k, (right, up, scale, turn) in enumerate(self.moves, 1)
        ]
        return [*found, f"the ceiling rose from {self.before.min():.1%} to {self.after.min():.1%} in the worst view"]

    def to_dict(self) -> dict:
        """As plain numbers, for `result.json`."""
        return {"moves": self.moves.tolist(), "ceiling_before": self.before.tolist(), "ceiling": self.after.tolist()}


def fit(
    pictures: np.ndarray,
    cameras: Sequence[Camera],
    bounds: Bounds,
    seen: Callable[[np.ndarray], np.ndarray] = np.asarray,
) -> Fitted:
    """How pictures `(K, H, H)` bool should give way, within bounds, for the views to agree.

    seen : what the cameras must see for the pictures, such as `Room.corrected`. Raises InputError as
    `hull_silhouettes`.
    """
    pictures = np.asarray(pictures, bool)
    before = _ceiling(seen(pictures), cameras)
    step = max(pictures.shape[-1] // COARSE, 1)
    coarse = pictures[:, ::step, ::step]
    pixels = _lattice(coarse.shape[-1], cameras)
    largest = np.array([bounds.shift, bounds.shift, bounds.scale, bounds.turn_deg])
    moves = np.tile(STILL, (len(pictures), 1))
    now = coarse.copy()
    score = _score(seen(now), pixels)
    for part in STEPS:
        for _ in range(ROUNDS):
            start = score
            for k, axis, sign in itertools.product(range(len(pictures)), range(4), (1, -1)):
                trial, tried = moves.copy(), now.copy()
                change = trial[k, axis] - STILL[axis] + sign * part * largest[axis]
                trial[k, axis] = STILL[axis] + np.clip(change, -largest[axis], largest[axis])
                tried[k] = moved(coarse[k], trial[k])
                cost = COST * (np.abs(trial - STILL) / np.maximum(largest, 1e-12)).sum()
                gained = _score(seen(tried), pixels) - cost
                if gained > score + LEAST_GAIN:
                    score, now, moves = gained, tried, trial
            if score == start:
                break
    fitted = Fitted(moves, before, before)
    after = _ceiling(seen(fitted.apply(pictures)), cameras)
    if after.min() <= before.min():  # what coarse pictures gained is not there
        return Fitted(np.tile(STILL, (len(pictures), 1)), before, before)
    return Fitted(moves, before, after)


def moved(picture: np.ndarray, move: np.ndarray) -> np.ndarray:
    """A picture `(H, H)` bool, or `(H, H, 3)` float with white beyond, shifted, scaled and turned about its middle."""
    right, up, scale, turn = move
    if np.array_equal(move, STILL):
        return picture
    size, angle = len(picture), np.radians(turn)
    # from a pixel of the result, row and column, back to the picture
    back = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]).T / scale
    middle = np.full(2, (size - 1) / 2)
    offset = middle - back @ (middle + size * np.array([-up, right]))
    if picture.ndim == 3:
        bands = [affine_transform(picture[..., c], back, offset, order=1, cval=1.0) for c in range(picture.shape[-1])]
        return np.stack(bands, -1)
    return affine_transform(picture.astype(float), back, offset, order=1) > 0.5


def _ceiling(images: np.ndarray, cameras: Sequence[Camera]) -> np.ndarray:
    return likeness(hull_silhouettes(images, cameras), images)


def _lattice(size: int, cameras: Sequence[Camera]) -> np.ndarray:
    """`(K, M)`: the pixels that show the points of a lattice in the viewing volume which all views see."""
    steps = ((np.arange(LATTICE) + 0.5) / LATTICE - 0.5) * min(camera.width for camera in cameras)
    points = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1).reshape(-1, 3)
    found, inside = [], np.ones(len(points), bool)
    for camera in cameras:
        row, column = camera.pixels(points, size)
        inside &= (row >= 0) & (row < size) & (column >= 0) & (column < size)
        found.append(row * size + column)
    return np.stack([pixels[inside] for pixels in found])


def _score(images: np.ndarray, pixels: np.ndarray) -> float:
    """The worst view's ceiling, and a little of all views'."""
    dark = images.reshape(len(images), -1)
    inside = np.logical_and.reduce([row[at] for row, at in zip(dark, pixels, strict=True)])
    hull = np.zeros_like(dark)
    for row, at in zip(hull, pixels, strict=True):
        row[at[inside]] = True
    found = (hull & dark).sum(1) / np.maximum(dark.sum(1), 1)
    return float(found.min() + 0.1 * found.mean())
