"""Tables of the user's as CSV: rows of named cells with their line's number, or one line that says what is wrong."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..util.errors import InputError


def rows(
    path: str | Path, needed: Mapping[str, str], others: Sequence[str] = (), synonyms: Mapping[str, str] | None = None
) -> list[tuple[int, dict[str, str]]]:
    """The rows below a table's line of column names: the line's number, and the cells that are not empty by column.

    needed : columns that must be there and in each row not empty, with what they are. others : further ones that may
    be. synonyms : names that stand for others. Names are read in lower case. Raises InputError naming row and column.
    """
    path = Path(path)
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            lines = csv.reader(file)
            found = [(lines.line_num, row) for row in lines if any(cell.strip() for cell in row)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or "it is no text in UTF-8 with commas"
        raise InputError(f"{path}: the table cannot be read ({reason})") from error
    if len(found) < 2:
        raise InputError(f"{path}: the table needs a line of column names and a row below it")
    allowed = (*needed, *others)
    names = [cell.strip().lower() for cell in found[0][1]]
    names = [(synonyms or {}).get(name, name) for name in names]
    for column, name in enumerate(names, 1):
        if name not in allowed or names.count(name) > 1:
            raise InputError(f"{path}: column {column} is called {name!r}; use each once of {', '.join(allowed)}")
    for name, what in needed.items():
        if name not in names:
            raise InputError(f"{path}: has no column {name}, {what}")
    read = []
    for number, row in found[1:]:
        if len(row) > len(names):
            raise InputError(f"{path}: row {number} has {len(row)} cells for {len(names)} columns")
        cells = {name: cell.strip() for name, cell in zip(names, row, strict=False) if cell.strip()}
        for name, what in needed.items():
            if name not in cells:
                raise InputError(f"{path}: row {number}, column {name}: {what} is needed, got nothing")
        read.append((number, cells))
    return read
