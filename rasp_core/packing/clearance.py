"""Packings with a clearance: any search, with grown bodies in a shrunk container; the bodies then have its poses.

Every body is grown by half of what is to be kept between two, the container shrunk by the rest of what is to be kept
from the wall. Grown solids that do not overlap are then as far apart as was asked; nothing else of a search changes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from ..geometry.containers import Container, FreeBox, box
from ..geometry.growing import grown, shrunk
from ..geometry.meshes import Body
from ..poses import Poses
from ..util.errors import InputError
from ..util.progress import progress_bar
from .enclosing_box import enclosing_box
from .result import Packing, finish

LEAST_GROWTH = 1e-3  # of the wall clearance: grown bodies are judged more strictly than others
FEW_TO_GROW = 4  # bodies, up to which growing shows no bar


@dataclass(frozen=True)
class Clearance:
    """How far bodies stay apart, metres.

    parts `(N,)` : for each body of a pool, of which the larger counts between two. wall : from the wall.
    Raises InputError where one is negative or not finite.
    """

    parts: np.ndarray
    wall: float

    def __post_init__(self):
        for name, values in (("clearance", self.parts), ("wall clearance", np.array([self.wall]))):
            if not np.isfinite(values).all() or (values < 0).any():
                wrong = values[~(np.isfinite(values) & (values >= 0))][0]
                raise InputError(f"a {name} must be a length of 0 or more, got {wrong:g} m")

    @property
    def growth(self) -> np.ndarray:
        """`(N,)` metres by which each body is grown: of two, together at least the larger clearance."""
        least = max(self.parts.min(initial=np.inf), 2 * LEAST_GROWTH * self.wall)
        return np.maximum(self.parts, least) - least / 2


def clearance_of(bodies: Sequence[Body], clearance: float | None, wall: float | None) -> Clearance | None:
    """What is asked for bodies, None if nothing is.

    clearance : metres, for those that do not ask for their own. wall : as much if None.
    """
    common = 0.0 if clearance is None else float(clearance)
    own = [common if body.wishes.clearance is None else body.wishes.clearance for body in bodies]
    asked = Clearance(np.array(own, np.float64), common if wall is None else float(wall))
    return asked if asked.parts.any() or asked.wall else None


def pack_apart(
    search: Callable[[Sequence[Body], Container | FreeBox], Packing],
    bodies: Sequence[Body],
    container: Container | FreeBox,
    clearance: Clearance,
    device: str | torch.device = "cpu",
    progress: bool = False,
) -> Packing:
    """What `search` packs of grown bodies in the shrunk container, as a packing of the bodies in the container.

    Its certificate says what the gaps are. Raises InputError as `search` does, and if nothing of the container is as
    far from its wall as is asked.
    """
    growth = clearance.growth
    margin = clearance.wall - float(growth.min())
    room = _shrunk_box(container, margin) if isinstance(container, FreeBox) else shrunk(container, margin)
    packed = search(_grown(bodies, growth, progress), room)
    chosen = [bodies[i] for i in packed.chosen]
    matrices = torch.from_numpy(packed.matrices)
    centres = torch.from_numpy(np.array([body.centre for body in chosen]))
    rotation = matrices[:, :3, :3]
    poses = Poses(rotation, matrices[:, :3, 3] + (rotation @ centres[:, :, None])[:, :, 0])
    if isinstance(container, FreeBox):
        closest, poses = enclosing_box(chosen, poses, _shrunk_box(container, clearance.wall))
        container = box([e or size + 2 * clearance.wall for e, size in zip(container.edges, closest.size, strict=True)])
    return finish(
        bodies,
        packed.chosen,
        poses,
        container,
        packed.arrangement.settings,
        device,
        history=[packed.history],
        rounds=packed.rounds,
        pulls=[packed.arrangement.pulls],
        interrupted=packed.arrangement.interrupted,
        clearance=(clearance.parts[packed.chosen], clearance.wall),
    )


def _grown(bodies: Sequence[Body], growth: np.ndarray, progress: bool) -> list[Body]:
    large = []
    with progress_bar("clearance", "object", progress and len(bodies) > FEW_TO_GROW, len(bodies)) as bar:
        for body, radius in zip(bodies, growth.tolist(), strict=True):
            apart = replace(body.wishes, clearance=None)  # the search itself keeps none
            large.append(replace(grown(body, radius), wishes=apart))
            bar.update()
    return large


def _shrunk_box(shape: FreeBox, margin: float) -> FreeBox:
    edges = tuple(None if edge is None else edge - 2 * margin for edge in shape.edges)
    if any(edge is not None and edge <= 0 for edge in edges):
        raise InputError(f"nothing between the fixed edges is {margin:.3g} m from the wall; ask for less clearance")
    return FreeBox(edges, shape.cube)
