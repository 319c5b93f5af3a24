"""The judge: exact mesh booleans of every pair that may touch, and of every body against the container."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from ..geometry.containers import Container
from ..geometry.meshes import Body
from .gaps import Gaps, measure
from .placing import core_inside, cores_apart, placed_solid

TOLERANCE = 1e-4  # of the smaller body's volume
SWEPT_AT_ONCE = 1024  # boxes, so that many need little memory
ROUNDING = 1e-9  # of what grown bodies keep clear
LEAST_OF_GROWN = 1.01 * TOLERANCE  # that counts of grown bodies, of whose overlap nothing is tolerated


@dataclass(frozen=True)
class Overlap:
    """Two bodies that share `volume` cubic metres, `fraction` of the smaller one."""

    first: str
    second: str
    volume: float
    fraction: float


@dataclass(frozen=True)
class Protrusion:
    """A body of which `volume` cubic metres, `fraction` of it, lie outside the container."""

    body: str
    volume: float
    fraction: float


@dataclass(frozen=True)
class Certificate:
    """What the booleans say. Faults are above `tolerance`, worst first; the worst fractions are over all bodies.

    gaps : what is asked of them and what they are, None if nothing is asked.
    """

    tolerance: float
    pairs_tested: int
    overlaps: list[Overlap]
    protrusions: list[Protrusion]
    worst_overlap: float
    worst_protrusion: float
    overlap_volume: float
    protrusion_volume: float
    gaps: Gaps | None = None

    @property
    def holds(self) -> bool:
        """True if nothing overlaps, nothing sticks out, and no gap is smaller than asked."""
        return not self.overlaps and not self.protrusions and (self.gaps is None or self.gaps.holds)

    @property
    def fault_volume(self) -> float:
        """Cubic metres that two bodies share, and that lie outside the container."""
        return self.overlap_volume + self.protrusion_volume

    def to_dict(self) -> dict:
        """As plain numbers, for `result.json`."""
        plain = {"holds": self.holds, **asdict(self)}
        del plain["gaps"]
        return plain if self.gaps is None else plain | {"gaps": self.gaps.to_dict()}

    def lines(self, unit: str = "m") -> list[str]:
        """Each fault in words, worst first; lengths in a unit of `loading.UNITS`."""
        gaps = [] if self.gaps is None else self.gaps.lines(unit)
        return (
            [f"{o.first} and {o.second} overlap by {o.fraction:.2e} of the smaller" for o in self.overlaps]
            + [f"{p.body} sticks out of the container by {p.fraction:.2e} of its volume" for p in self.protrusions]
            + gaps
        )


def certify(
    bodies: Sequence[Body],
    matrices: np.ndarray,
    container: Container,
    tolerance: float = TOLERANCE,
    clearance: tuple[np.ndarray | float, float] | None = None,
) -> Certificate:
    """Judge bodies placed by `matrices` `(N, 4, 4)` (from file coordinates to the world) in a container.

    Boxes are tested first: a boolean meets only bodies whose boxes intersect, and against a container that is a box
    only those whose boxes leave it. What grown bodies share counts if the bodies inside are too near to each other.
    clearance : what is asked between bodies and from the wall, as `gaps.measure` has it, which then measures the gaps.
    """
    gaps = None if clearance is None else measure(bodies, matrices, container, *clearance)
    solids = [placed_solid(body, matrix) for body, matrix in zip(bodies, matrices, strict=True)]
    boxes = np.array([solid.bounding_box() for solid in solids]).reshape(-1, 2, 3)
    overlaps, tested, worst, total = [], 0, 0.0, 0.0
    for i, j in pairs_of_boxes(boxes):
        tested += 1
        shared = max((solids[i] ^ solids[j]).volume(), 0.0)
        if shared > 0 and (bodies[i].grown or bodies[j].grown):
            if cores_apart(bodies, matrices, i, j, -ROUNDING):
                continue
            shared = max(shared, LEAST_OF_GROWN * min(bodies[i].volume, bodies[j].volume))
        fraction = shared / min(bodies[i].volume, bodies[j].volume)
        worst, total = max(worst, fraction), total + shared
        if fraction > tolerance:
            overlaps.append(Overlap(bodies[i].name, bodies[j].name, shared, fraction))
    protrusions, worst_out, total_out = [], 0.0, 0.0
    hull = container.body.manifold.translate(container.body.centre)
    for i, solid in enumerate(solids):
        if container.size is not None and (np.abs(boxes[i]) <= container.size / 2).all():
            continue
        out = max((solid - hull).volume(), 0.0)
        if out > 0 and bodies[i].grown:
            if core_inside(bodies[i], matrices[i], container, -ROUNDING):
                continue
            out = max(out, LEAST_OF_GROWN * bodies[i].volume)
        fraction = out / bodies[i].volume
        worst_out, total_out = max(worst_out, fraction), total_out + out
        if fraction > tolerance:
            protrusions.append(Protrusion(bodies[i].name, out, fraction))
    overlaps.sort(key=lambda o: -o.fraction)
    protrusions.sort(key=lambda p: -p.fraction)
    return Certificate(tolerance, tested, overlaps, protrusions, worst, worst_out, total, total_out, gaps)


def pairs_of_boxes(boxes: np.ndarray) -> list[tuple[int, int]]:
    """Index pairs i < j of boxes `(N, 2, 3)` that share volume, in order; by a sweep along one axis."""
    low, high = boxes[:, 0], boxes[:, 1]
    axis = int(np.argmax(np.ptp(low, axis=0) / (high - low).mean(0).clip(1e-300))) if len(boxes) else 0
    order = np.argsort(low[:, axis], kind="stable")
    low, high, found = low[order], high[order], []
    ends = np.searchsorted(low[:, axis], high[:, axis])  # of those that begin before this one ends
    for start in range(0, len(order), SWEPT_AT_ONCE):
        first = np.arange(start, min(start + SWEPT_AT_ONCE, len(order)))
        count = (ends[first] - first - 1).clip(0)
        i = np.repeat(first, count)
        j = i + 1 + np.arange(len(i)) - np.repeat(np.cumsum(count) - count, count)
        meet = (low[i] < high[j]).all(1) & (low[j] < high[i]).all(1)
        found.append(np.sort(order[np.stack([i[meet], j[meet]], 1)], axis=1))
    pairs = np.concatenate(found) if found else np.zeros((0, 2), int)
    return list(map(tuple, pairs[np.lexsort(pairs.T[::-1])].tolist()))
