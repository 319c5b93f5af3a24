"""Where pieces are missing: rough surface that no other piece lies on, in connected patches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Hole:
    """A connected patch of fracture that nothing lies on. centre `(3,)` metres, in the world; area in square metres."""

    centre: np.ndarray
    area: float

    def to_dict(self) -> dict:
        """As plain numbers, for `result.json`."""
        return {"centre": self.centre.tolist(), "area": self.area}
