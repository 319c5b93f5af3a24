"""A heap in a room, at the door: its shadows where lamps throw them, a picture, and a sheet to set it up by."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from ..art.room import Room
from ..art.room_file import read_room
from ..art.sculpture import Sculpture
from ..silhouettes import likeness
from ..util.errors import InputError


def room_for(room: str | Path | Room, count: int, plain: bool) -> Room:
    """The room, read if it is a file, for `count` pictures.

    plain : whether neither directions nor colours are asked for besides. Raises InputError if they are, for another
    number of lamps, and as `read_room`.
    """
    if not plain:
        raise InputError("a room says where lamps are; leave out azimuths, elevations, the projection and paint")
    room = room if isinstance(room, Room) else read_room(room)
    if len(room.throws) != count:
        raise InputError(f"each of {count} pictures needs a lamp of its own, the room has {len(room.throws)}")
    return room


@dataclass(frozen=True)
class InRoom:
    """A heap between lamps and walls.

    room : where they are. sculpture : the heap, before cameras in the lamps' places. wanted `(K, H, H)` bool: the
    pictures as they are to fall on the surfaces.
    """

    room: Room
    sculpture: Sculpture
    wanted: np.ndarray

    @property
    def scale(self) -> float:
        """By what the heap's lengths are multiplied to be those of the room: its objects are made anew in that size."""
        return self.room.cameras()[0].width / self.sculpture.cameras[0].width

    @property
    def size(self) -> np.ndarray:
        """`(3,)` metres: the heap's extent in the room."""
        return np.ptp(self.surface[0], axis=0)

    @cached_property
    def surface(self) -> tuple[np.ndarray, np.ndarray]:
        """The heap as one surface, vertices `(V, 3)` in the room's metres about the heap's middle, and faces."""
        placed = [b.placed(m) for b, m in zip(self.sculpture.bodies, self.sculpture.matrices, strict=True)]
        first = np.cumsum([0, *(len(points) for points in placed)])[:-1]
        faces = [body.solid_faces + start for body, start in zip(self.sculpture.bodies, first, strict=True)]
        return self.scale * np.concatenate(placed), np.concatenate(faces)

    @cached_property
    def shadows(self) -> np.ndarray:
        """`(K, H, H)` bool: what is dark on the surfaces, in the squares of the pictures."""
        return self.room.shadows(*self.surface, self.wanted.shape[-1])

    @property
    def likeness(self) -> np.ndarray:
        """`(K,)` intersection over union of the shadows with the pictures, on the surfaces."""
        return likeness(self.shadows, self.wanted)

    def line(self) -> str:
        """What it is, in words."""
        x, y, z = self.size
        alike = ", ".join(
            f"{share:.1%} on the {throw.surface.name}"
            for share, throw in zip(self.likeness, self.room.throws, strict=True)
        )
        return f"in the room: {x:.2f} x {y:.2f} x {z:.2f} m, objects at {self.scale:.3g} of their size; shadows {alike}"

    def to_dict(self) -> dict:
        """As plain numbers, for `result.json`."""
        return {
            **self.room.to_dict(),
            "scale": self.scale,
            "size": self.size.tolist(),
            "likeness": self.likeness.tolist(),
        }

    def picture(self, size: int = 1200) -> np.ndarray:
        """`(H, W, 3)` uint8: the heap, its lamps' light and its shadows, as they are in the room."""
        from ..visualize.room_pictures import in_room

        return in_room(self.room, self.sculpture, self.scale, size)

    def sheet(self) -> str:
        """A page in HTML with the measures to set it up by: plan, side view, distances, shadows."""
        from ..visualize.room_pictures import sheet

        return sheet(self.room, self.size, self.scale, self.shadows, self.likeness)
