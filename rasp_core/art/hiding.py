"""Where struts stay hidden: in every view behind what is dark anyway, or below the picture, where a base may show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import distance_transform_edt, map_coordinates

from ..geometry.cameras import PERSPECTIVE_DISTANCE, Camera
from ..util.errors import InputError

STEEP_DEG = 45.0  # a view from higher than this has its shadow on the base; lower, it sees the base below the picture
FARTHEST_WIDTHS = 1.5  # below what is lowest: how low a base may be
REFINED = 2  # a mask's pixels are parted in so many along an edge
PERSPECTIVE_SPARE = 0.9  # of a clearance, as an eye sees a ball as a little more than its disc


@dataclass(frozen=True)
class Hiding:
    """What K views do not see.

    cameras : K. dark `(K, H, H)` bool: what is dark anyway, or may be. bottom `(K,)` int: the row below the last one
    that may be, where the picture ends; what lies below may be seen. H for steep views, whose shadow falls on the base.
    """

    cameras: Sequence[Camera]
    dark: np.ndarray
    bottom: np.ndarray

    @classmethod
    def of(cls, allowed: np.ndarray, there: np.ndarray, cameras: Sequence[Camera], lift: int = 0) -> Hiding:
        """allowed, there `(K, H, H)` bool: the silhouettes that pictures allow, and those of what is to be joined.
        lift : by how many rows the pictures end higher.

        Raises InputError for a view from below, before which a base would stand.
        """
        for camera in cameras:
            if camera.elevation_deg < -STEEP_DEG:
                raise InputError(f"a base would stand before the view {camera.direction}; look from above instead")
        size = allowed.shape[-1]
        last = [size - lift - int(np.argmax(picture.any(1)[::-1])) for picture in allowed]
        bottom = np.array([size if steep(c) else row for c, row in zip(cameras, last, strict=True)])
        return cls(cameras, allowed | there, bottom)

    def base_top(self, low: np.ndarray, high: np.ndarray) -> float:
        """The height where a base as wide as the box `low`, `high` `(3,)` begins to be below all pictures.

        Raises InputError where there is none.
        """
        size, width = self.dark.shape[-1], self.cameras[0].width
        corners = np.array([(x, y, 0.0) for x in (low[0], high[0]) for y in (low[1], high[1])])
        for top in np.arange(high[2], low[2] - FARTHEST_WIDTHS * width, -0.5 * width / size):
            places = corners + np.array([0, 0, top])
            seen = (
                camera.pixels(places, size)[0].min() < bottom
                for camera, bottom in zip(self.cameras, self.bottom, strict=True)
                if not steep(camera)
            )
            if not any(seen):
                return float(top)
        raise InputError("no base stays below all pictures; give level views, or views straight from above")

    def clearance(self, points: np.ndarray) -> np.ndarray:
        """`(P,)` metres: how large a ball about points `(P, 3)` no view sees; at most 0 where the point is seen."""
        least = np.full(len(points), np.inf)
        for camera, free in zip(self.cameras, self._free, strict=True):
            right, up, depth = camera.axes @ (points - np.asarray(camera.centre)).T / camera.width
            zoom, spare = np.ones(len(points)), 1.0
            if camera.projection == "perspective":
                zoom, spare = PERSPECTIVE_DISTANCE / (PERSPECTIVE_DISTANCE + depth), PERSPECTIVE_SPARE
            edge = REFINED * self.dark.shape[-1]
            middle = len(free) / 2 - 0.5
            at = np.stack([middle - up * zoom * edge, middle + right * zoom * edge])
            found = map_coordinates(free, at, order=1, mode="nearest")
            least = np.minimum(least, spare * found / zoom * camera.width / edge)
        return least

    @cached_property
    def _free(self) -> list[np.ndarray]:
        """For each view a picture `(2R, 2R)` about its own, of finer pixels: how many of them to the nearest one where
        a strut would be seen."""
        found = []
        for camera, picture, bottom in zip(self.cameras, self.dark, self.bottom, strict=True):
            fine = picture.repeat(REFINED, 0).repeat(REFINED, 1)
            beyond = len(fine) // 2
            wide = np.pad(fine, beyond)
            if not steep(camera):
                wide[beyond + bottom * REFINED :] = True
            found.append(distance_transform_edt(wide) - 0.5)
        return found


def steep(camera: Camera) -> bool:
    """Whether a view's shadow falls on the base."""
    return camera.elevation_deg > STEEP_DEG
