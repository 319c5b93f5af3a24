"""A search's bar on standard error."""

from __future__ import annotations

import sys

from tqdm.auto import tqdm

TERMINAL_SECONDS, LOG_SECONDS = 0.2, 10  # between two states of the bar, on a terminal and in a log file


def progress_bar(name: str, unit: str, shown: bool, total: int | None = None) -> tqdm:
    """A bar that counts in `unit` up to `total` (None: without end), silent if not `shown`; few lines in a log file."""
    seconds = TERMINAL_SECONDS if sys.stderr.isatty() else LOG_SECONDS
    return tqdm(desc=name, unit=unit, disable=not shown, leave=False, mininterval=seconds, total=total)
