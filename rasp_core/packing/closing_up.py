"""A packing in a box to be found, closed up again where something was taken out or dropped: compacted as it is."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..geometry.containers import FreeBox
from ..geometry.growing import shrunk_shape
from ..geometry.meshes import Body
from ..poses import file_to_world, from_matrices
from .best_box import BestBox
from .clearance import Clearance
from .compaction import Compaction


def closed_up(
    bodies: Sequence[Body],
    matrices: np.ndarray,
    shape: FreeBox,
    edges: np.ndarray,
    clearance: Clearance | None,
    late: Callable[[], bool],
) -> tuple[np.ndarray, np.ndarray] | None:
    """Where bodies placed by `matrices` `(N, 4, 4)` in a box of `edges` `(3,)` come to by `Compaction`, and the smaller
    box's edges; None if it gets no smaller or does not hold.

    clearance : of these bodies, which is kept. late : whether time is over.
    """
    large, margin = list(bodies), 0.0
    if clearance is not None:
        large, margin = [clearance.grown(i, body) for i, body in enumerate(bodies)], clearance.margin
    inner, start = shrunk_shape(shape, margin), from_matrices(large, matrices)
    compaction, room = Compaction(large, inner), edges - 2 * margin
    found = compaction.run(start.rotation.numpy(), start.translation.numpy(), room, late)
    best = BestBox(large, inner, lambda edges, density: None)
    if found.edges.prod() >= room.prod() or not best.hold(found.poses, found.edges) or best.least >= room.prod():
        return None
    return file_to_world(large, best.poses.rotation, best.poses.translation), best.edges + 2 * margin
