"""Places for all parts of a broken thing, one after the other: a beam search over orders and places.

A part that fits at many places of the whole, as on a bowl, waits until a neighbour shows which; a step that looks best
may still be wrong, so several assemblies are followed, and the best of all surface decides at the end.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from tqdm.auto import tqdm

from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..util.errors import InputError
from .registration import FOUND, Docking, Part, Place, apart, cost

FOLLOWED = 2  # places of each part that are followed
HULL_FOLLOWED, HULL_BEAM = 20, 320  # where a hull alone tells little: places of each part, and assemblies times parts
BEAM = 4  # assemblies that are followed where one alone comes to no good end
FEW = 12  # parts at most for which they are
GOOD = 0.85  # quality above which the end is good
SWEEPS = 2  # in which each part is drawn in once more between all others
DOUBTFUL = 0.7, 0.8, 0.7, 0.8, 0.85, 0.7  # scores under which parts are looked at anew, round by round
VAIN = 2  # rounds without a gain after which that ends
LEAST_GAIN = 0.01  # of quality
LARGE = 0.02  # of its surface: what a part leads by for being large, where nothing else shows which to place first
ALIKE = 0.1  # radians, and share of a part's radius: poses nearer than that are the same place


@dataclass(frozen=True)
class _State:
    """Parts that have their places, by number, in the order in which they came; found: places of the others, the best
    first; lead: the surface, in square metres, by which the places led the next best ones."""

    docking: Docking
    order: tuple[int, ...]
    found: Mapping[int, list[Place]]
    lead: float = 0.0

    def like(self, other: _State) -> bool:
        """Whether the same parts are at the same places."""
        places = dict(zip(other.order, other.docking.placed, strict=True))
        return set(self.order) == set(other.order) and not any(
            _differ(part, place, places[i][1]) for i, (part, place) in zip(self.order, self.docking.placed, strict=True)
        )

    @property
    def places(self) -> list[Place]:
        """In the order of the parts."""
        places = dict(zip(self.order, self.docking.placed, strict=True))
        return [places[i][1] for i in sorted(places)]

    @property
    def quality(self) -> float:
        """The parts' score in the mean, each by its surface."""
        areas = [part.area for part, _ in self.docking.placed]
        return float(np.average([place.score for _, place in self.docking.placed], weights=areas))


def solve(bodies: Sequence[Body], whole: Container, seed: int = 0, progress: bool = False) -> list[Place]:
    """A place for each part, and its score between all others. Raises InputError where one fits nowhere."""
    with tqdm(disable=not progress, desc="assemble", unit="part", leave=False) as bar:
        search = _Search(bodies, whole, seed, bar)
        best = search.mended(search.fill(search.empty, 1)[0])
        if best.quality < GOOD and 2 < len(bodies) <= FEW:
            best = max(best, search.mended(search.fill(search.empty, BEAM)[0]), key=lambda state: state.quality)
    return best.places


def candidates(bodies: Sequence[Body], hull: Container, seed: int = 0, progress: bool = False) -> list[list[Place]]:
    """Places for all parts within a hull, in many ways; which is right shows elsewhere. Raises InputError as `solve`
    does."""
    with tqdm(disable=not progress, desc="assemble", unit="part", leave=False) as bar:
        search = _Search(bodies, hull, seed, bar, HULL_FOLLOWED)
        return [state.places for state in search.fill(search.empty, max(1, HULL_BEAM // len(bodies)))]


def draw_together(bodies: Sequence[Body], hull: Container, places: Sequence[Place]) -> list[Place]:
    """Each part but the largest is drawn in between the others within the hull, surface to surface."""
    docking = Docking(hull, attracts=False)
    for body, place in zip(bodies, places, strict=True):
        docking.put(Part(body), place)
    _draw_together(docking, still=int(np.argmax([body.volume for body in bodies])))
    return [place for _, place in docking.placed]


class _Search:
    """Parts that find their places; alone: each one's in the empty whole, the best first."""

    def __init__(
        self,
        bodies: Sequence[Body],
        whole: Container,
        seed: int,
        bar: tqdm,
        followed: int = FOLLOWED,
    ):
        self.parts, self.seed, self.bar, self.tries = [Part(body) for body in bodies], seed, bar, 0
        self.followed = followed
        empty = Docking(whole)
        self.alone = self._places([(empty, i, [], None) for i in range(len(bodies))])
        for body, found in zip(bodies, self.alone, strict=True):
            if not found:
                raise InputError(f"{body.name} fits nowhere in the whole; is it a part of it?")
        self.empty = _State(empty, (), dict(enumerate(self.alone)))

    def _places(self, wanted: Sequence[tuple[Docking, int, list[Place], int | None]]) -> list[list[Place]]:
        """For each docking and part: the places known so far with their scores now, and new ones, which touch the
        placed part of that number, where one is given."""
        first, self.tries = self.tries, self.tries + len(wanted)

        def one(k: int) -> list[Place]:
            docking, i, known, about = wanted[k]
            part, random = self.parts[i], np.random.default_rng([self.seed, first + k])
            known = [place for place in docking.rescored(part, known) if place.score > 0] if known else []
            found = sorted([*known, *docking.places(part, random, about)], key=cost)
            return apart(found, FOUND, ALIKE, ALIKE * part.body.radius)

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            return list(pool.map(one, range(len(wanted))))

    def _around(self, docking: Docking, order: tuple[int, ...]) -> _State:
        """The state of parts that are placed, by number, with places for all others."""
        rest = [i for i in range(len(self.parts)) if i not in order]
        return _State(
            docking, order, dict(zip(rest, self._places([(docking, i, [], None) for i in rest]), strict=True))
        )

    def fill(self, state: _State, width: int) -> list[_State]:
        """Places for the parts that have none, the best first; `width` assemblies are followed."""
        states = [state]
        while states[0].found:
            # what fits nowhere beside the others lies, doubtfully, where it would alone
            steps = [
                (state.lead + self._lead(i, place, found), state, i, place)
                for state in states
                for i, found in state.found.items()
                for place in (found or self.alone[i])[: self.followed]
            ]
            states = []
            for lead, before, i, place in sorted(steps, key=lambda step: -step[0]):
                docking = before.docking.copy()
                docking.put(self.parts[i], place)
                rest = {k: found for k, found in before.found.items() if k != i}
                state = _State(docking, (*before.order, i), rest, lead)
                if not any(state.like(other) for other in states):
                    states.append(state)
                    if len(states) == width:
                        break
            wanted = [(s.docking, i, known, len(s.order) - 1) for s in states for i, known in s.found.items()]
            found = iter(self._places(wanted))
            states = [replace(s, found={i: next(found) for i in s.found}) for s in states]
            self.bar.update()
        for state in states:
            _draw_together(state.docking)
        return sorted(states, key=lambda state: -state.quality)

    def mended(self, state: _State) -> _State:
        """The parts that lie doubtfully are taken out and looked at anew, as long as that betters the whole."""
        vain = 0
        for least in DOUBTFUL if len(self.parts) > 2 else ():
            if vain == VAIN:
                break
            pairs = zip(state.order, state.docking.placed, strict=True)
            kept = [(i, part, place) for i, (part, place) in pairs if place.score >= least]
            if len(kept) == len(self.parts):
                continue
            docking = self.empty.docking.copy()
            for _, part, place in kept:
                docking.put(part, place)
            again = self.fill(self._around(docking, tuple(i for i, _, _ in kept)), 1)[0]
            vain = 0 if again.quality > state.quality + LEAST_GAIN else vain + 1
            state = max(state, again, key=lambda state: state.quality)
        return state

    def _lead(self, i: int, place: Place, found: Sequence[Place]) -> float:
        """The surface, in square metres, by which a place leads the part's others, those in the empty whole too."""
        part = self.parts[i]
        rivals = [other.score for other in (*found, *self.alone[i]) if _differ(part, place, other)]
        return part.area * (place.score - max(rivals, default=0.0) + LARGE)


def _differ(part: Part, one: Place, other: Place) -> bool:
    return one.far_from(other, ALIKE, ALIKE * part.body.radius)


def _draw_together(docking: Docking, still: int | None = None) -> None:
    """Each part, but the one that is to be `still`, is drawn in between all others, where it lies better then; all
    scores are those at the end."""
    for sweep in range(SWEEPS + 1):
        for k, (part, place) in enumerate(docking.placed):
            now = replace(place, score=docking.score(part, place))
            drawn = docking.draw_in(part, [now]) if sweep < SWEEPS and k != still else []
            docking.move(k, max([now, *drawn], key=lambda place: place.score))
