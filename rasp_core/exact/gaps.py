"""How near solids come to each other and to the wall, exactly: the least distance between their triangles.

A clearance is judged on the bodies themselves. A search that keeps one moves grown bodies in a shrunk container
(`geometry.growing`); there two count as overlapping only if the bodies inside come too near.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from ..geometry.containers import Container
from ..geometry.loading import UNITS
from ..geometry.meshes import Body
from ..util.errors import InputError
from .placing import distance_to_wall, placed_solid

TOLERANCE = 2.0**-23  # of the container's longest edge: scenes are written in numbers of 32 bits
WALL = "container"  # what a gap to the wall names second


@dataclass(frozen=True)
class Gap:
    """Two bodies, or a body and the container, `gap` metres from each other; `asked` is what they should be."""

    first: str
    second: str
    gap: float
    asked: float


@dataclass(frozen=True)
class Gaps:
    """What gaps there are. clearance, wall_clearance : the most that is asked of any, metres. clearances : what is
    asked of each body that is asked for another clearance than `clearance`, by its name. tolerance : metres that may be
    missing. least, least_to_wall : the least gaps, None where there is none. short : those that are too small, worst
    first."""

    clearance: float
    clearances: dict[str, float]
    wall_clearance: float
    tolerance: float
    least: Gap | None
    least_to_wall: Gap | None
    short: list[Gap]

    @property
    def holds(self) -> bool:
        """True if no gap is too small."""
        return not self.short

    def to_dict(self) -> dict:
        """As plain numbers, for `result.json`."""
        return {"holds": self.holds, **asdict(self)}

    def of(self, bodies: Sequence[Body]) -> np.ndarray:
        """What is asked of each body `(N,)`, metres."""
        return np.array([self.clearances.get(body.name, self.clearance) for body in bodies])

    def lines(self, unit: str = "m") -> list[str]:
        """Each gap that is too small in words, worst first; lengths in a unit of `loading.UNITS`."""
        return [
            f"{g.first} and {g.second} are {_told(g.gap, unit)} apart, {_told(g.asked, unit)} are asked"
            for g in self.short
        ]

    def summary(self, unit: str = "m") -> str:
        """The least gaps, in words; lengths in a unit of `loading.UNITS`."""
        one, wall = self.least, self.least_to_wall
        between = [] if one is None else [f"{_told(one.gap, unit)} ({one.first}, {one.second})"]
        walls = [] if wall is None else [f"to the wall {_told(wall.gap, unit)} ({wall.first})"]
        return f"least gap {', '.join([*between, *walls]) or 'is of fixed objects alone'}"


def measure(
    bodies: Sequence[Body],
    matrices: np.ndarray,
    container: Container,
    clearance: float | Sequence[float],
    wall_clearance: float,
) -> Gaps:
    """The gaps between bodies placed by `matrices` `(N, 4, 4)` (from file coordinates to the world), and to the wall.

    clearance : metres asked between two bodies, or for each body, of which the larger counts between two.
    wall_clearance : metres asked from the wall. Gaps of fixed bodies among themselves and from the wall do not count.
    Raises InputError for what is no length, or as many as bodies.
    """
    for name, values in (("clearance", clearance), ("wall clearance", wall_clearance)):
        check_lengths(name, np.asarray(values, np.float64))
    if np.ndim(clearance) and np.shape(clearance) != (len(bodies),):
        raise InputError(
            f"a clearance for each of {len(bodies)} objects is needed, got {np.size(clearance)}; give as many, or one"
        )
    solids = [placed_solid(body, matrix) for body, matrix in zip(bodies, matrices, strict=True)]
    boxes = np.array([solid.bounding_box() for solid in solids]).reshape(-1, 2, 3)
    asked_of = np.broadcast_to(np.asarray(clearance, np.float64), len(bodies))
    tolerance = TOLERANCE * float(np.ptp(container.bounds, axis=0).max())
    found: list[Gap] = []
    least = np.inf
    for i, j, apart in _by_distance(boxes):
        if bodies[i].wishes.fixed and bodies[j].wishes.fixed:
            continue
        asked = float(max(asked_of[i], asked_of[j]))
        if apart > max(least, asked_of.max()):
            break
        reach = max(min(least, apart + np.ptp(boxes[[i, j]], axis=(0, 1)).sum()), asked)
        gap = float(solids[i].min_gap(solids[j], reach))
        if gap < reach:
            found.append(Gap(bodies[i].name, bodies[j].name, gap, asked))
            least = min(least, gap)
    distance, size = distance_to_wall(container), float(np.ptp(container.bounds, axis=0).max())
    walls: list[Gap] = []
    for body, solid in zip(bodies, solids, strict=True):
        if not body.wishes.fixed:
            reach = max(min((one.gap for one in walls), default=size), wall_clearance)
            walls.append(Gap(body.name, WALL, distance(solid, reach), wall_clearance))
    short = [one for one in (*found, *walls) if one.gap < one.asked - tolerance]
    return Gaps(
        clearance=float(asked_of.max()),
        clearances={b.name: float(one) for b, one in zip(bodies, asked_of, strict=True) if one < asked_of.max()},
        wall_clearance=wall_clearance,
        tolerance=tolerance,
        least=min(found, key=lambda one: one.gap, default=None),
        least_to_wall=min(walls, key=lambda one: one.gap, default=None),
        short=sorted(short, key=lambda one: one.gap - one.asked),
    )


def check_lengths(name: str, values: np.ndarray) -> None:
    """Raise InputError for a clearance of that name that is negative or not finite, metres."""
    wrong = values[~(np.isfinite(values) & (values >= 0))]
    if wrong.size:
        raise InputError(f"a {name} must be a length of 0 or more, got {wrong.flat[0]:g} m")


def _told(metres: float, unit: str) -> str:
    return f"{metres / UNITS[unit]:.4g} {unit}"


def _by_distance(boxes: np.ndarray) -> list[tuple[int, int, float]]:
    """Pairs i < j of boxes `(N, 2, 3)` and how far they are apart, the nearest first."""
    low, high = boxes[:, 0], boxes[:, 1]
    between = np.maximum(low[:, None] - high[None], low[None] - high[:, None]).clip(min=0)
    apart = np.linalg.norm(between, axis=-1)
    first, second = np.triu_indices(len(boxes), 1)
    order = np.argsort(apart[first, second], kind="stable")
    return [(int(i), int(j), float(apart[i, j])) for i, j in zip(first[order], second[order], strict=True)]
