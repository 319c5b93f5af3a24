"""A sculpture: objects in a cube that show a different picture from each side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..exact.certified import Certified
from ..silhouettes import likeness
from .ceiling import disagreements


@dataclass(frozen=True)
class Sculpture(Certified):
    """Objects in a cube, the viewing volume, and their pictures, the arrangement's targets.

    pictures `(K, H, H)` bool: what was asked for; hull `(K, H, H)` bool: the silhouettes of the pictures' visual hull.
    rounds : what each width gave. colours `(K, H, H, 3)` in [0, 1]: of the pictures, if it was made to be painted.
    """

    pictures: np.ndarray
    hull: np.ndarray
    rounds: Sequence[dict]
    colours: np.ndarray | None = None

    @property
    def likeness(self) -> np.ndarray:
        """`(K,)` intersection over union with the pictures."""
        return likeness(self.arrangement.images > 0.5, self.pictures)

    @property
    def ceiling(self) -> np.ndarray:
        """`(K,)` the hull's intersection over union with the pictures."""
        return likeness(self.hull, self.pictures)

    @property
    def of_ceiling(self) -> np.ndarray:
        """`(K,)` intersection over union with the hull's silhouettes."""
        return likeness(self.arrangement.images > 0.5, self.hull)

    @property
    def warnings(self) -> list[str]:
        """Lines of text, one for each picture that the others do not allow."""
        return disagreements(self.pictures, self.hull, self.cameras)

    def to_dict(self) -> dict:
        """What result.json says of it, as plain numbers."""
        measures = {"likeness": self.likeness, "ceiling": self.ceiling, "likeness_of_ceiling": self.of_ceiling}
        return {**{name: values.tolist() for name, values in measures.items()}, "rounds": list(self.rounds)}
