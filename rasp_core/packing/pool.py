"""The objects to choose from: drawn, scaled to a container, and refused if one cannot fit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ..geometry.cavities import describe_wall
from ..geometry.containers import Container
from ..geometry.loading import UNITS
from ..geometry.meshes import Body, unique_names
from ..geometry.sdf import bake_cached
from ..util.errors import InputError

MOST_DRAWN = 100_000  # objects
ROUNDING = 1 + 1e-6  # what fits exactly, fits, whatever the last bits of a file's numbers say
MILLIMETRES = 1e-3
SAME_VOLUME = 1e-9  # of the largest body's: sums that differ by less are equal
OTHER_UNIT = 5  # times the container's diameter: a body as large as that is perhaps in another unit


def draw(bodies: Sequence[Body], count: int, seed: int) -> list[Body]:
    """`count` bodies drawn with replacement; copies are named `<name>#2`, ...

    Raises InputError for a count below 1 or above `MOST_DRAWN`.
    """
    if not 1 <= count <= MOST_DRAWN:
        raise InputError(f"1 to {MOST_DRAWN:,} objects can be drawn, got {count}")
    chosen = np.random.default_rng(seed).integers(0, len(bodies), count)
    return unique_names([bodies[i] for i in chosen])


def fit_scale(bodies: Sequence[Body], container: Container, count: int) -> float:
    """The factor on lengths with which `count` mean objects make half of the container's volume.

    Raises InputError for a count below 1.
    """
    if count < 1:
        raise InputError(f"objects can be fitted to one or more, got {count}")
    return float((0.5 * container.volume / count / np.mean([body.volume for body in bodies])) ** (1 / 3))


def check_sizes(bodies: Sequence[Body], container: Container, unit: str = "m") -> None:
    """Raise InputError for no bodies, or naming the first that is too large for the container however it is turned.

    unit : one of `loading.UNITS`, that the error is written in. A body that fits has no more volume, no larger diameter
    and no larger inscribed ball than the container. Of grown bodies in a shrunk container the error names the bodies,
    the whole container, and what is kept clear.
    """
    if not bodies:
        raise InputError("there is nothing to pack; give at least one object")
    fits = fitting(bodies, container)
    body = next((body for i, body in enumerate(bodies) if i not in fits), None)
    if body is None:
        return
    whole, clear = np.ptp(container.whole.bounds, axis=0), ""
    size = " x ".join(f"{2 * h / UNITS[unit]:.3g}" for h in body.inside.half_extents)
    room = " x ".join(f"{edge / UNITS[unit]:.3g}" for edge in whole)
    if container.whole is not container:
        kept = body.growth + float((whole - np.ptp(container.bounds, axis=0)).max()) / 2
        clear = f" with {kept / UNITS[unit]:.3g} {unit} clear on all sides" if kept > 0 else ""
    remedy = "leave it out, enlarge the container, or scale the objects with --fit-objects"
    if 2 * body.radius > OTHER_UNIT * _diameter(container.body) and fitting([body.scaled(MILLIMETRES)], container):
        remedy = "a thousandth of it would fit: if the file is in millimetres, say so with --unit mm"
    if container.size is None:
        remedy = describe_wall(container.whole.body) or remedy
    raise InputError(f"{body.name}: {size} {unit}{clear} is larger than the container, {room} {unit}; {remedy}")


def fitting(bodies: Sequence[Body], container: Container) -> set[int]:
    """Indices of the bodies that are not surely too large for the container by what `check_sizes` looks at."""
    diameter, ball = _diameter(container.body), _largest_ball(container)
    known = {body.digest: body for body in bodies}
    fits = {digest for digest, body in known.items() if not _too_large(body, container, diameter, ball)}
    return {i for i, body in enumerate(bodies) if body.digest in fits}


def kind(body: Body) -> tuple:
    """Equal for bodies of equal shape of which the same turns are wished."""
    turns = body.wishes.turns
    return body.digest, None if turns is None else turns.word, () if turns is None else turns.bases.tobytes()


class Worth:
    """What the bodies of a pool are worth to a packing: those of a higher rank come first, then volume counts.

    volumes `(N,)` cubic metres. rank `(N,)`: 0 for the least; those that must go in have the highest.
    """

    def __init__(self, pool: Sequence[Body]):
        self.volumes = np.array([body.volume for body in pool])
        wished = [(body.wishes.must, 0.0 if body.wishes.must else body.wishes.priority) for body in pool]
        self.rank = np.array([sorted(set(wished)).index(one) for one in wished], np.int64)

    def first(self, order: np.ndarray) -> np.ndarray:
        """Indices `(M,)` in the same order, but those of higher rank first."""
        return order[np.argsort(-self.rank[order], kind="stable")] if self.rank.any() else order

    def volume(self, chosen: Iterable[int]) -> float:
        """Of these of the pool, in cubic metres."""
        return float(self.volumes[list(chosen)].sum())

    def more(self, chosen: Iterable[int], other: Iterable[int], by: float = 0.0) -> bool:
        """Whether some of the pool are worth more than others; by : cubic metres at least, if only volume tells."""
        told, gain = self.compared(chosen, other), self.volume(chosen) - self.volume(other)
        return told > 0 or (told == 0 and gain > max(by, SAME_VOLUME * self.volumes.max()))

    def compared(self, chosen: Iterable[int], other: Iterable[int]) -> int:
        """1 if some of the pool are worth more than others by their ranks, -1 if less, 0 if only volume tells."""
        for rank in range(self.rank.max(initial=0), 0, -1):
            one, two = (sum(self.volumes[i] for i in some if self.rank[i] == rank) for some in (chosen, other))
            if abs(one - two) > SAME_VOLUME * self.volumes.max():
                return 1 if one > two else -1
        return 0


def _too_large(body: Body, container: Container, diameter: float, ball: float) -> bool:
    """Whether a body surely does not fit into a container of that diameter and inscribed ball."""
    return (
        body.volume > ROUNDING * container.volume
        or (2 * body.radius > ROUNDING * diameter and _diameter(body) > ROUNDING * diameter)
        or (body.half_extents.min() > ROUNDING * ball and _inscribed_radius(body) > ROUNDING * ball)
    )


def _diameter(body: Body) -> float:
    """Largest distance in metres between two points of the body."""
    corners = body.hull_corners
    return max(float(np.linalg.norm(corners - corner, axis=1).max()) for corner in corners)


def _largest_ball(container: Container) -> float:
    """Radius in metres that no ball in the container exceeds."""
    if container.size is not None:
        return float(container.size.min()) / 2
    grid = bake_cached(container.body)
    return float(-grid.values.min()) + 3**0.5 / 2 * grid.spacing  # the deepest point lies so near to one of the grid


def _inscribed_radius(body: Body) -> float:
    """Radius in metres of a ball that surely lies in the body (the deepest point of its grid)."""
    return float(-bake_cached(body).values.min())
