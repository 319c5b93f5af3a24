"""Packings with a clearance, and around what is there: any search, with grown bodies in a shrunk container.

Every body is grown by half of what is to be kept between two, the container shrunk by the rest of what is to be kept
from the wall. Grown solids that do not overlap are then as far apart as was asked; nothing else of a search changes.
Fixed bodies, grown too, are zones without which the container is searched. Of bodies with unequal clearances, two that
ask for more than the least keep more than that from each other and from the wall.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
import torch

from ..exact.certificate import certify
from ..geometry.containers import Container, FreeBox
from ..geometry.growing import TooNarrow, shrunk, shrunk_shape
from ..geometry.loading import UNITS
from ..geometry.meshes import Body
from ..geometry.zones import box_of, without
from ..poses import from_matrices, join
from ..util.errors import InputError
from ..util.progress import progress_bar
from .clearance import Clearance
from .enclosing_box import enclosing_box
from .result import Packing, finish_anew

LEAST_SECONDS = 1e-3  # that are left to a search, however long growing took
FEW_TO_GROW = 4  # bodies, up to which growing shows no bar


def pack_apart(
    search: Callable[..., Packing],
    bodies: Sequence[Body],
    container: Container | FreeBox,
    clearance: Clearance | None,
    fixed: Sequence[Body] = (),
    device: str | torch.device = "cpu",
    time_limit: float | None = None,
    progress: bool = False,
    unit: str = "m",
) -> Packing:
    """What `search` packs of grown bodies in the shrunk container, as a packing of the bodies in the container.

    search : called with bodies, a container and the `time_limit` in seconds that growing left. clearance : of the
    bodies and then the fixed ones, None if nothing is asked. fixed : bodies that lie in the container already; what
    they cover, grown too, is no place for the others. They are the last of the packing's bodies and of its pool.
    The certificate says what the gaps are. unit : of `loading.UNITS`, that errors are written in. Raises InputError as
    `search` does, if fixed bodies overlap or stick out, and if nothing of the container is as far from its wall as is
    asked.
    """
    _check_fixed(fixed, container)
    asked = Clearance(np.zeros(len(bodies) + len(fixed)), 0.0) if clearance is None else clearance
    began, margin = time.monotonic(), asked.margin
    try:
        room = shrunk_shape(container, margin) if isinstance(container, FreeBox) else shrunk(container, margin)
    except TooNarrow:
        kept = f"{asked.wall / UNITS[unit]:.3g} {unit}"
        raise InputError(f"nothing of the container is {kept} from its wall; ask for less clearance") from None
    pool = [*bodies, *fixed]
    large = _grown(pool, asked, progress)
    if fixed:
        room = without(room, large[len(bodies) :], whole=container)
    left = None if time_limit is None else max(LEAST_SECONDS, time_limit - (time.monotonic() - began))
    packed = search(large[: len(bodies)], room, time_limit=left)
    chosen = [pool[i] for i in packed.chosen]
    poses = from_matrices(chosen, packed.matrices)
    if isinstance(container, FreeBox):
        floor = packed.container.base.size - 2 * (asked.wall - margin) if container.zones else None
        closest, poses = enclosing_box(chosen, poses, shrunk_shape(container, asked.wall), floor)
        container = box_of(container, container.lengths(closest.base.size + 2 * asked.wall))

    def finished(positions: Sequence[int]) -> Packing:
        indices = [*(packed.chosen[i] for i in positions), *range(len(bodies), len(pool))]
        there = from_matrices(fixed, np.tile(np.eye(4), (len(fixed), 1, 1)))
        return finish_anew(packed, pool, indices, join(poses.take(positions), there), container, device, clearance)

    kept = list(range(len(chosen)))
    found = finished(kept)
    if packed.certificate.holds and not found.certificate.holds and fixed:
        # what is tolerated of a body in a fixed one may be too much of the fixed one, where that is the smaller
        faults = {name for one in found.certificate.overlaps for name in (one.first, one.second)}
        kept = [i for i in kept if chosen[i].name not in faults]
        found = finished(kept)
    return found


def _check_fixed(fixed: Sequence[Body], container: Container | FreeBox) -> None:
    if not fixed:
        return
    if isinstance(container, FreeBox):
        raise InputError("what is fixed needs a container that is given; a box to be found has no place yet")
    certificate = certify(fixed, np.tile(np.eye(4), (len(fixed), 1, 1)), container)
    if not certificate.holds:
        raise InputError(
            f"what is fixed must fit: {certificate.lines()[0]}; leave it out, or name it a zone to keep out"
        )


def _grown(bodies: Sequence[Body], clearance: Clearance, progress: bool) -> list[Body]:
    large = []
    with progress_bar("clearance", "object", progress and len(bodies) > FEW_TO_GROW, len(bodies)) as bar:
        for i, body in enumerate(bodies):
            large.append(clearance.grown(i, body))
            bar.update()
    return large
