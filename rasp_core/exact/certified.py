"""Objects at poses in a container, with what exact booleans say of them: what packing, assembly and art give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..density import mesh_density
from ..geometry.cameras import Camera
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..optimizer import Arrangement
from ..poses import Poses
from .certificate import Certificate


@dataclass(frozen=True)
class Certified:
    """arrangement : poses, silhouettes, targets, losses. certificate : of those poses."""

    arrangement: Arrangement
    certificate: Certificate

    @property
    def bodies(self) -> Sequence[Body]:
        """The objects, N of them."""
        return self.arrangement.problem.bodies

    @property
    def container(self) -> Container:
        """What they lie in."""
        return self.arrangement.problem.container

    @property
    def matrices(self) -> np.ndarray:
        """`(N, 4, 4)` float64: from each file's coordinates to the world, metres, column vectors."""
        return self.arrangement.matrices

    @property
    def poses(self) -> Poses:
        """Rotations `(N, 3, 3)` and translations `(N, 3)` of the objects' centres, to go on from."""
        return self.arrangement.poses

    @property
    def cameras(self) -> Sequence[Camera]:
        """The K views."""
        return self.arrangement.cameras

    @property
    def images(self) -> np.ndarray:
        """`(K, H, H)` float32 silhouettes in [0, 1], row 0 on top, one for each view."""
        return self.arrangement.images

    @property
    def density(self) -> float:
        """Eq. 6: the objects' volume over the container's."""
        return mesh_density(self.bodies, self.container)
