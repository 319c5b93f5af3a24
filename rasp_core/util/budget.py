"""What a search may use: seconds, tries, or both."""

from __future__ import annotations

import time

from .errors import InputError


class Budget:
    """Seconds since it was made, and tries counted; None where one of them has no limit.

    Raises InputError for a negative effort.
    """

    def __init__(self, time_limit: float | None = None, effort: int | None = None):
        if effort is not None and effort < 0:
            raise InputError(f"effort must not be negative, got {effort}")
        self.began, self.time_limit, self.effort, self.tries = time.monotonic(), time_limit, effort, 0

    @property
    def used(self) -> float:
        """The fraction of the time or of the tries that is used up, the larger; 0 without limits."""
        by_time = 0.0 if not self.time_limit else (time.monotonic() - self.began) / self.time_limit
        return max(by_time, 0.0 if not self.effort else self.tries / self.effort)

    def seconds(self, seconds: float) -> float:
        """The fraction of the time that so many seconds are; 0 without a limit."""
        return seconds / self.time_limit if self.time_limit else 0.0

    def spent(self, fraction: float = 1.0) -> bool:
        """True where a fraction of the time is over."""
        return self.time_limit is not None and time.monotonic() - self.began > fraction * self.time_limit

    def over(self, fraction: float = 1.0) -> bool:
        """True where a fraction of the time or of the tries is used up."""
        return self.spent(fraction) or (self.effort is not None and self.tries >= fraction * self.effort)
