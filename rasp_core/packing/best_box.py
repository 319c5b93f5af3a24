"""The smallest box so far in which all objects hold, by exact booleans."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..exact.certificate import certify
from ..exact.overlap_removal import REPAIR_TOLERANCE, remove_overlaps
from ..geometry.containers import Container, FreeBox
from ..geometry.meshes import Body
from ..geometry.zones import box_of
from ..poses import Poses, file_to_world
from .enclosing_box import enclosing_box


class BestBox:
    """volume, taken : cubic metres, of all bodies, and of these as they are grown. container, poses : the box, and
    where all bodies lie in it; None before the first. told : is called with the box's edges `(3,)`, metres, and the
    density whenever it is a smaller one."""

    def __init__(self, bodies: Sequence[Body], shape: FreeBox, told: Callable[[np.ndarray, float], None]) -> None:
        self.bodies, self.shape, self.told = bodies, shape, told
        self.volume = float(np.sum([body.volume for body in bodies]))
        self.taken = float(np.sum([body.taken for body in bodies]))
        self.container: Container | None = None
        self.poses: Poses | None = None

    @property
    def least(self) -> float:
        """The product of its edges, cubic metres; infinite before the first."""
        return np.inf if self.container is None else float(self.edges.prod())

    @property
    def edges(self) -> np.ndarray:
        """`(3,)`, metres."""
        return self.container.base.size

    def hold(self, poses: Poses, edges: np.ndarray, largest: float = np.inf) -> bool:
        """Take out what overlaps at some poses in a box of these edges, as `remove_overlaps` does with `largest`, then
        `keep` what comes of it; False where it cannot be taken out."""
        held = remove_overlaps(self.bodies, poses, box_of(self.shape, edges), REPAIR_TOLERANCE, largest)
        return held is not None and self.keep(held, edges)

    def keep(self, poses: Poses, edges: np.ndarray | None = None) -> bool:
        """Certify all at some poses, in the box that just holds them or in that of these edges, the smaller; kept, and
        True, if it holds and is smaller than the best."""
        container, poses = enclosing_box(self.bodies, poses, self.shape, edges)
        if container.base.size.prod() >= self.least:
            return False
        matrices = file_to_world(self.bodies, poses.rotation, poses.translation)
        if not certify(self.bodies, matrices, container).holds:
            return False
        self.container, self.poses = container, poses
        meant, covered = self.edges + 2 * self.shape.margin, self.least - container.volume
        self.told(meant, self.volume / (float(meant.prod()) - covered))
        return True
