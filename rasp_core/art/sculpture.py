"""A sculpture: objects in a cube that show a different picture from each side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..exact.certificate import Certificate
from ..geometry.cameras import Camera
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..optimizer import Arrangement
from ..poses import Poses
from ..silhouettes import likeness
from .ceiling import disagreements


@dataclass(frozen=True)
class Sculpture:
    """Objects and their pictures.

    arrangement, certificate : objects in a cube, the viewing volume; the arrangement's targets are the pictures.
    pictures `(K, H, H)` bool: what was asked for; hull `(K, H, H)` bool: the silhouettes of the pictures' visual hull.
    rounds : what each width gave. colours `(K, H, H, 3)` in [0, 1]: of the pictures, if it was made to be painted.
    """

    arrangement: Arrangement
    certificate: Certificate
    pictures: np.ndarray
    hull: np.ndarray
    rounds: Sequence[dict]
    colours: np.ndarray | None = None

    @property
    def bodies(self) -> Sequence[Body]:
        """The objects, copies numbered."""
        return self.arrangement.problem.bodies

    @property
    def matrices(self) -> np.ndarray:
        """`(N, 4, 4)` float64: from each file's coordinates to the world."""
        return self.arrangement.matrices

    @property
    def poses(self) -> Poses:
        """Of the bodies' centres."""
        return self.arrangement.poses

    @property
    def container(self) -> Container:
        """The viewing volume."""
        return self.arrangement.problem.container

    @property
    def cameras(self) -> Sequence[Camera]:
        """The K views."""
        return self.arrangement.cameras

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
