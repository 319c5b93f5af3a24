"""The directions that pictures are seen from."""

from __future__ import annotations

from collections.abc import Sequence

from ..geometry.cameras import Camera
from ..util.errors import InputError

AZIMUTHS_DEG = {2: (0.0, 90.0), 3: (0.0, 120.0, 240.0), 4: (0.0, 45.0, 90.0, 135.0)}  # by the number of pictures


def cameras_for(
    count: int,
    azimuths_deg: Sequence[float] | None = None,
    elevations_deg: Sequence[float] | None = None,
    *,
    width: float = 1.0,
    projection: str = "orthographic",
) -> list[Camera]:
    """A camera about the origin for each of `count` pictures.

    azimuths_deg, elevations_deg : degrees, AZIMUTHS_DEG and 0 if not given. width : metres. Raises InputError unless
    each picture has both angles, and as `Camera` does.
    """
    azimuths = list(azimuths_deg or AZIMUTHS_DEG.get(count, [0.0] * count))
    elevations = list(elevations_deg or [0.0] * len(azimuths))
    if not count == len(azimuths) == len(elevations):
        raise InputError(
            f"each of {count} pictures needs an azimuth and an elevation, got {len(azimuths)}, {len(elevations)}"
        )
    return [
        Camera(azimuth, elevation, width, projection=projection)
        for azimuth, elevation in zip(azimuths, elevations, strict=True)
    ]
