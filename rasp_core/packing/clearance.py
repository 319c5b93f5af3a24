"""What is asked of gaps: how far bodies stay apart and from the wall; of all, of each, or as result.json has it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Real

import numpy as np

from ..exact.gaps import check_lengths
from ..geometry.growing import grown
from ..geometry.meshes import Body
from ..util.errors import InputError

LEAST_GROWTH = 1e-3  # of the wall clearance: grown bodies are judged more strictly than others


@dataclass(frozen=True)
class Clearance:
    """How far bodies stay apart, metres.

    parts `(N,)` : for each body of a pool, of which the larger counts between two. wall : from the wall.
    Raises InputError where one is negative or not finite.
    """

    parts: np.ndarray
    wall: float

    def __post_init__(self):
        check_lengths("clearance", self.parts)
        check_lengths("wall clearance", np.array(self.wall))

    @cached_property
    def growth(self) -> np.ndarray:
        """`(N,)` metres by which each body is grown: of two, together at least the larger clearance."""
        least = max(self.parts.min(initial=np.inf), 2 * LEAST_GROWTH * self.wall)
        return np.maximum(self.parts, least) - least / 2

    @property
    def margin(self) -> float:
        """Metres by which a container is shrunk for grown bodies: what of the wall's clearance they have not grown."""
        return self.wall - float(self.growth.min(initial=np.inf))

    def grown(self, index: int, body: Body) -> Body:
        """A body of the pool, by its number there, grown; that keeps any clearance, and it asks for none itself."""
        radius = float(self.growth[index])
        return replace(grown(body, radius) if radius > 0 else body, wishes=replace(body.wishes, clearance=None))


def clearance_of(
    bodies: Sequence[Body], clearance: float | None = None, wall_clearance: float | None = None
) -> Clearance | None:
    """What is asked for bodies, None if nothing is.

    clearance : metres, for those that do not ask for their own. wall_clearance : as much if None. Raises InputError for
    what is no length.
    """
    for name, length in (("clearance", clearance), ("wall clearance", wall_clearance)):
        if not isinstance(length, Real | None):
            raise InputError(f"a {name} is one length in metres, got {length}; give parts their own by rasp.Item")
    common = 0.0 if clearance is None else float(clearance)
    own = [common if body.wishes.clearance is None else body.wishes.clearance for body in bodies]
    asked = Clearance(np.array(own, np.float64), common if wall_clearance is None else float(wall_clearance))
    return asked if asked.parts.any() or asked.wall else None


def asked_of(bodies: Sequence[Body], record: dict) -> tuple[list[Body], dict[str, float]]:
    """What a run's result.json says was asked: the bodies with their own clearances, by their names, and those of all,
    by the names of `clearance_of`; none where nothing was. Raises InputError where it makes no sense.
    """
    try:
        gaps = record["certificate"].get("gaps")
        own = {} if gaps is None else {name: float(length) for name, length in gaps["clearances"].items()}
        common = {} if gaps is None else {name: float(gaps[name]) for name in ("clearance", "wall_clearance")}
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError("what the run's result.json asks for cannot be read; give --clearance") from error
    there = {entry["name"] for entry in record.get("objects", ()) if entry.get("fixed")}
    wished = [replace(body.wishes, clearance=own.get(body.name), fixed=body.name in there) for body in bodies]
    return [replace(body, wishes=wishes) for body, wishes in zip(bodies, wished, strict=True)], common
