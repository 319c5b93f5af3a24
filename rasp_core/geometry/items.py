"""Parts with quantities and wishes: `Item`s from a table (CSV), from words like `part.stl*12`, or made in Python."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..io import tables
from ..util.errors import InputError
from .loading import METRES, Reading, load_bodies
from .meshes import Body, unique_names
from .wishes import WORDS, Wishes, check_turns, turns_of

MOST_COPIES = 100_000
OTHER_NAMES = {"quantity": "count", "rotate": "turns", "color": "colour"}
YES, NO = ("yes", "true", "1", "x"), ("no", "false", "0", "")


@dataclass(frozen=True)
class Item:
    """A part, how many of it, and what is wished of it.

    part : a mesh file, a folder, or a body. count : copies. must : all of them go in, before others. priority : of the
    others the larger go in first. turns : any, z, 90, flat:N, none, or a list such as "0 0 0; 90 0 0", as
    `wishes.turns_of` has it. scale : on its lengths. clearance : metres, None for that of all; of two parts the larger
    counts. colour : #rrggbb, None for one of the kit's.

    Raises InputError where a field makes no sense.

    >>> import rasp_core as rasp
    >>> from data_fetch import kitchen_like
    >>> twelve = rasp.Item(kitchen_like(1)[0], count=12, turns="z", must=True)
    >>> len(twelve.bodies())
    12
    """

    part: str | Path | Body
    count: int = 1
    must: bool = False
    priority: float = 0.0
    turns: str = "any"
    scale: float = 1.0
    clearance: float | None = None
    colour: str | None = None

    def __post_init__(self):
        if not 0 <= self.count <= MOST_COPIES:
            raise InputError(f"count must be a whole number from 0 to {MOST_COPIES}, got {self.count}")
        if not np.isfinite(self.priority):
            raise InputError(f"priority must be a number, got {self.priority}")
        if not (np.isfinite(self.scale) and self.scale > 0):
            raise InputError(f"scale must be positive, got {self.scale}")
        if self.clearance is not None and not (np.isfinite(self.clearance) and self.clearance >= 0):
            raise InputError(f"clearance must be a length of 0 or more, got {self.clearance}")
        check_turns(self.turns.strip().lower())
        _rgb(self.colour)

    def bodies(self, reading: Reading = METRES) -> list[Body]:
        """Its bodies, copy after copy, with the wishes. Raises MeshError for a file that cannot be used."""
        read = [self.part] if isinstance(self.part, Body) else load_bodies([self.part], reading)
        wished = []
        for body in read:
            body = body if self.scale == 1 else body.scaled(self.scale)
            wishes = Wishes(
                turns_of(self.turns, body.manifold), self.must, self.priority, self.clearance, _rgb(self.colour)
            )
            wished.append(replace(body, wishes=wishes))
        return wished * self.count


def bodies_of(items: Iterable[Item], reading: Reading = METRES) -> list[Body]:
    """The bodies of all items; copies are named `<name>#2`, ... Raises InputError where there are none."""
    bodies = [body for item in items for body in item.bodies(reading)]
    if not bodies:
        raise InputError("there is nothing to pack; give at least one part with a count of 1 or more")
    return unique_names(bodies)


def item_of(word: str) -> Item:
    """A part from a word of the command line: a file, or `part.stl*12`. Raises InputError for a count that is none."""
    path, star, count = word.rpartition("*")
    if not star or Path(word).exists():
        return Item(word)
    if not count.isdecimal():
        raise InputError(f"{word!r}: after * a whole number of copies is needed, such as part.stl*12")
    return Item(path, int(count))


def read_table(path: str | Path, reading: Reading = METRES) -> list[Item]:
    """The items of a table: a CSV with the columns file and, as far as wanted, count, must, priority, turns, scale,
    clearance (in the reading's unit) and colour. Files are relative to the table.

    Raises InputError naming row, column and what is expected.
    """
    path = Path(path)
    rows = tables.rows(path, {"file": "the part's mesh"}, tuple(COLUMNS), OTHER_NAMES)
    return [_item(path, number, cells, reading) for number, cells in rows]


def _item(path: Path, number: int, cells: dict[str, str], reading: Reading) -> Item:
    part = path.parent / cells.pop("file")
    if not part.exists():
        raise InputError(f"{path}: row {number}, column file: {part} is not there")
    fields = {}
    for name, cell in cells.items():
        read, expected = COLUMNS[name]
        try:
            value = read(cell)
            value = value * reading.metres if name == "clearance" else value
            Item(part, **{name: value})
        except (ValueError, InputError) as error:
            raise InputError(f"{path}: row {number}, column {name}: {expected} is expected, got {cell!r}") from error
        fields[name] = value
    return Item(part, **fields)


def _yes(cell: str) -> bool:
    if cell.lower() not in (*YES, *NO):
        raise ValueError
    return cell.lower() in YES


def _turns(cell: str) -> str:
    return "z" if cell.lower() == "z only" else cell.lower()


def _rgb(colour: str | None) -> tuple[float, float, float] | None:
    """Red, green and blue in [0, 1] of #rrggbb. Raises InputError for other words."""
    if colour is None:
        return None
    try:
        if len(colour) != 7 or colour[0] != "#":
            raise ValueError
        return tuple(int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    except ValueError as error:
        raise InputError(f"colour must be #rrggbb, got {colour!r}") from error


COLUMNS: dict[str, tuple[Callable[[str], object], str]] = {
    "count": (int, f"a whole number from 0 to {MOST_COPIES}"),
    "must": (_yes, "yes or no"),
    "priority": (float, "a number, the larger go in first,"),
    "turns": (_turns, WORDS),
    "scale": (float, "a positive number"),
    "clearance": (float, "a length of 0 or more"),
    "colour": (str, "#rrggbb"),
}
