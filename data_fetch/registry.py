"""The registry: each real data file with its URL and hash. None of the files themselves is in the project."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from pathlib import Path

GROUPS = ("kitchen", "general", "blockout", "cad", "containers", "fracture", "targets", "nesting")


@dataclass(frozen=True)
class Entry:
    """One file of a data set."""

    group: str
    name: str
    bytes: int
    sha256: str
    url: str
    licence: str


@cache
def entries(group: str) -> tuple[Entry, ...]:
    """The files of a data set, sorted by name. Raises KeyError for a set that the registry does not have."""
    if group not in GROUPS:
        raise KeyError(f"data set {group!r} is not in the registry; use one of {', '.join(GROUPS)}")
    with (Path(__file__).parent / "registry.csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["group"] == group]
    found = [Entry(**{**row, "bytes": int(row["bytes"])}) for row in rows]
    return tuple(sorted(found, key=lambda entry: entry.name))
