"""What options of the command line must be; each check raises InputError naming the option and what is expected."""

from __future__ import annotations

import argparse
from collections.abc import Iterable

from ..util.errors import InputError

CLEARANCES = ("clearance", "wall_clearance")
MOST_SLICED = 250  # pixels of a silhouette along the container, where slices take its place


def check_time(options: argparse.Namespace) -> None:
    """Seconds are positive."""
    if options.time_limit is not None and not options.time_limit > 0:
        raise InputError(f"--time-limit must be positive, got {options.time_limit}")


def check_clearances(options: argparse.Namespace) -> None:
    """Clearances are lengths, or none."""
    for name in CLEARANCES:
        length = getattr(options, name)
        if length is not None and not 0 <= length < float("inf"):
            raise InputError(f"--{name.replace('_', '-')} must be a length of 0 or more, got {length:g}")


def check_slices(options: argparse.Namespace, shadows: Iterable[str | None]) -> None:
    """Points inside bodies are as dense as pixels of slices, and too many of them are not held."""
    from ..problem import SHADOWS, Settings

    resolution, volume = options.resolution or Settings.resolution, options.viewing_volume or Settings.viewing_volume
    if any(SHADOWS.get(name) for name in shadows) and resolution > MOST_SLICED * volume:
        raise InputError(
            f"slices have at most {MOST_SLICED} pixels along the container, --resolution over --viewing-volume; got "
            f"{resolution} over {volume:g}"
        )


def count_of(text: str) -> int | None:
    """The number of objects, None for `auto`."""
    if text == "auto":
        return None
    try:
        count = int(text)
    except ValueError:
        count = 0
    if count < 1:
        raise InputError(f"--count must be auto or a positive number, got {text}")
    return count
