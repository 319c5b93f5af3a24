"""Orthographic and perspective views, named by azimuth and elevation, world z up.

Azimuth 0 looks along +y (image right is +x, image up is +z), azimuth 90 looks along -x (image right is +y),
elevation 90 looks down (at azimuth 0: image right +x, image up +y). Images are `(H, W)`, row 0 on top.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from ..util.errors import InputError

# A perspective eye stands this many widths from the centre.
PERSPECTIVE_DISTANCE = 2.0


@dataclass(frozen=True)
class Camera:
    """One view of the viewing volume, a cube of edge `width` (metres) about `centre`.

    projection : "orthographic", whose image covers exactly the cube's face, or "perspective", whose eye stands two
        widths before the centre and whose image covers the square of edge `width` through the centre.

    Raises InputError for an unknown projection, a width that is not positive, or angles that are not finite.
    """

    azimuth_deg: float
    elevation_deg: float
    width: float
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    projection: str = "orthographic"

    def __post_init__(self):
        if self.projection not in ("orthographic", "perspective"):
            raise InputError(f"projection {self.projection!r} is unknown; use orthographic or perspective")
        if not (self.width > 0 and math.isfinite(self.width)):
            raise InputError(f"a view's width must be positive, got {self.width}")
        if not (math.isfinite(self.azimuth_deg) and math.isfinite(self.elevation_deg)):
            raise InputError(f"a view's angles must be finite, got {self.azimuth_deg}, {self.elevation_deg}")

    @property
    def axes(self) -> np.ndarray:
        """`(3, 3)` float64, rows: image right, image up, and the direction of looking, in the world."""
        azimuth, elevation = math.radians(self.azimuth_deg), math.radians(self.elevation_deg)
        right = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
        forward = np.array(
            [
                -math.sin(azimuth) * math.cos(elevation),
                math.cos(azimuth) * math.cos(elevation),
                -math.sin(elevation),
            ]
        )
        return np.stack([right, np.cross(right, forward), forward])

    @property
    def direction(self) -> str:
        """Where it looks from, in words."""
        return f"at azimuth {self.azimuth_deg:g}, elevation {self.elevation_deg:g}"

    @property
    def eye(self) -> np.ndarray:
        """`(4,)` homogeneous: the eye's place and 1, or the direction back to it and 0 where it is at infinity."""
        forward = self.axes[2]
        if self.projection == "orthographic":
            return np.append(-forward, 0.0)
        return np.append(np.asarray(self.centre) - PERSPECTIVE_DISTANCE * self.width * forward, 1.0)

    def rays(self, resolution: int) -> tuple[np.ndarray, np.ndarray]:
        """Origins and unit directions, both `(resolution, resolution, 3)`, through the pixels' centres."""
        steps = (np.arange(resolution) + 0.5) / resolution - 0.5
        right, up, forward = self.axes
        u, v = np.meshgrid(steps * self.width, -steps * self.width)
        plane = np.asarray(self.centre) + u[..., None] * right + v[..., None] * up
        if self.projection == "orthographic":
            return plane - 2 * self.width * forward, np.broadcast_to(forward, plane.shape).copy()
        directions = plane - self.eye[:3]
        origins = np.broadcast_to(self.eye[:3], plane.shape).copy()
        return origins, directions / np.linalg.norm(directions, axis=-1, keepdims=True)

    def pixels(self, points: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
        """Row and column, both `(M,)` int64, of the pixels that show world points `(M, 3)`; they may lie beside the
        image of `size` x `size`."""
        right, up, depth = self.axes @ (np.asarray(points) - np.asarray(self.centre)).T / self.width
        zoom = 1.0 if self.projection == "orthographic" else PERSPECTIVE_DISTANCE / (PERSPECTIVE_DISTANCE + depth)
        return np.floor((0.5 - up * zoom) * size).astype(int), np.floor((0.5 + right * zoom) * size).astype(int)

    def to_dict(self) -> dict:
        """The view as plain numbers, as `result.json` lists it."""
        return {**asdict(self), "centre": [float(x) for x in self.centre]}


def box_views(width: float, centre: Sequence[float]) -> list[Camera]:
    """The three faces of a box: from the front, from the side, from above."""
    centre = tuple(float(x) for x in centre)
    return [Camera(azimuth, elevation, width, centre) for azimuth, elevation in ((0, 0), (90, 0), (0, 90))]


def spread_views(count: int, width: float, centre: Sequence[float]) -> list[Camera]:
    """`count` views whose directions differ as much as opposite-free directions can (a spiral on the half sphere).

    Opposite orthographic views show the same shadow, so only the upper half sphere is used. Raises InputError for
    fewer than one view.
    """
    if count < 1:
        raise InputError(f"at least one view is needed, got {count}")
    centre = tuple(float(x) for x in centre)
    golden = 180 * (3 - math.sqrt(5))
    return [Camera((k * golden) % 360, math.degrees(math.asin((k + 0.5) / count)), width, centre) for k in range(count)]
