"""Boxes of several kinds from a table (CSV): what each is, and how many there are."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..io import tables
from ..util.errors import InputError
from .containers import Container, FreeBox, parse
from .loading import METRES, Reading

MOST_BOXES = 1000  # of one kind


def read_boxes(
    path: str | Path, reading: Reading = METRES, directions: Sequence[tuple[float, float]] | None = None
) -> list[tuple[Container | FreeBox, int | None]]:
    """The kinds of boxes of a table, in its order, each with how many there are, None for as many as are needed.

    Its columns are container, as `containers.parse` has it (files relative to the table), and count, a whole number, 1
    if there is none, or auto in the last row. directions : azimuth and elevation in degrees of each view of all boxes.

    Raises InputError naming row, column and what is expected.
    """
    path, kinds = Path(path), []
    rows = tables.rows(path, {"container": "box:X,Y,Z or a mesh file"}, ("count",))
    for number, cells in rows:
        count = cells.get("count", "1").lower()
        if not ((count == "auto" and number == rows[-1][0]) or (count.isdecimal() and 1 <= int(count) <= MOST_BOXES)):
            raise InputError(
                f"{path}: row {number}, column count: a whole number from 1 to {MOST_BOXES}, or auto in the last row, "
                f"is expected, got {cells['count']!r}"
            )
        try:
            room = parse(cells["container"], reading, path.parent)
        except InputError as error:
            raise InputError(f"{path}: row {number}, column container: {error}") from error
        room = room if directions is None or isinstance(room, FreeBox) else room.seen_from(directions)
        kinds.append((room, None if count == "auto" else int(count)))
    return kinds
