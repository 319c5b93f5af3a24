"""Rooms as JSON: where the heap, its lamps, walls and floor are, in metres, z up.

{"heap": [0, 0, 1], "surfaces": {"wall": {"point": [0, 0.4, 0], "normal": [0, -1, 0]}},
 "lamps": [{"at": [0, -0.6, 1], "onto": "wall", "height": 0.4}]}
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..util.errors import InputError
from .room import Room, Surface, Throw

LARGEST = 1 << 20  # bytes


def read_room(path: str | Path) -> Room:
    """The room of a file. Raises InputError naming it where it cannot be read, and as `room_of`."""
    path = Path(path)
    try:
        with path.open("rb") as file:
            text = file.read(LARGEST + 1)
        if len(text) > LARGEST:
            raise InputError(f"{path}: is no room, but more than {LARGEST} bytes; give a JSON file")
        entries = json.loads(text.decode("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: cannot be read as a room ({error}); give a JSON file") from error
    try:
        return room_of(entries)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def room_of(entries: Mapping) -> Room:
    """The room of a file's entries. Raises InputError for what is missing or no number, and as `Room` does."""
    surfaces = {
        name: Surface(str(name), _place(entry, "point", f"surface {name}"), _normal(entry, f"surface {name}"))
        for name, entry in _entry(entries, "surfaces", dict, "a room").items()
    }
    throws = []
    for number, lamp in enumerate(_entry(entries, "lamps", list, "a room"), 1):
        where = f"lamp {number}"
        onto = _entry(lamp, "onto", str, where)
        if onto not in surfaces:
            raise InputError(f"{where} shines onto {onto!r}, which is none of {', '.join(map(str, surfaces))}")
        height = _entry(lamp, "height", (int, float), where)
        if not 0 < height < float("inf"):
            raise InputError(f"the height of a shadow must be positive, got {height:g} at {where}")
        throws.append(Throw(_place(lamp, "at", where), surfaces[onto], float(height)))
    return Room(_place(entries, "heap", "a room"), throws)


def _entry(entries, name: str, kind, where: str):
    if not isinstance(entries, Mapping) or not isinstance(entries.get(name), kind):
        raise InputError(f"{where} needs {name!r}; see the example in the README")
    return entries[name]


def _place(entries, name: str, where: str) -> np.ndarray:
    given = _entry(entries, name, list, where)
    numbers = [x for x in given if isinstance(x, (int, float)) and abs(x) < float("inf")]
    if len(given) != 3 or len(numbers) != 3:
        raise InputError(f"{name!r} of {where} must be three numbers, got {given}")
    return np.array(numbers, float)


def _normal(entries, where: str) -> np.ndarray:
    normal = _place(entries, "normal", where)
    if not np.linalg.norm(normal) > 0:
        raise InputError(f"the normal of {where} must not be 0, 0, 0")
    return normal
