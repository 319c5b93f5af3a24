"""Broken things put back together: each part where it belongs in the whole, then all drawn together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from tqdm.auto import tqdm

from .arrange import file_to_world
from .containers import Container
from .docking import Docking, Part, Place
from .errors import InputError
from .meshes import Body
from .problem import Start

LOOKED_AT = 3  # parts tried at each step, the largest first
CLEAR = 0.25  # lead over the next best place above which a part's place is clear
ROUNDS = 3  # in which parts that lie doubtfully are taken out and looked at anew
SWEEPS = 2  # in which each part is drawn in once more between all others
SPARE = 0.03  # share of the whole's volume by which the parts may miss it without a word
MOST = 1.2  # of the whole's volume: parts that have more are not its parts
POOR = 0.5  # score under which a part's place is doubtful


@dataclass(frozen=True)
class Assembly:
    """Where the parts belong.

    start : their poses, in the order of `bodies`. scores `(N,)`: the share of each part's surface that lies on the
    whole's surface or on a neighbour's, less twice the share that is where it must not be. warnings: lines of text.
    """

    bodies: Sequence[Body]
    whole: Container
    start: Start
    scores: np.ndarray
    warnings: Sequence[str] = ()

    @property
    def matrices(self) -> np.ndarray:
        """`(N, 4, 4)` float64: from each file's coordinates to the world."""
        return file_to_world(self.bodies, self.start.rotation, self.start.translation)


def assemble(bodies: Sequence[Body], whole: Container, seed: int = 0, progress: bool = False) -> Assembly:
    """Find the parts' places in the whole; their own poses are not looked at.

    At each step the largest few parts that are left are tried, and the one whose place is clearest is kept: how far its
    score leads the next best place's. Parts that fit at many places wait until their neighbours are there.
    Raises InputError for fewer than two parts, for parts of more volume than the whole's, and where one fits nowhere.
    """
    if len(bodies) < 2:
        raise InputError(f"assembly needs at least two parts, got {len(bodies)}")
    share = sum(body.volume for body in bodies) / whole.volume
    if share > MOST:
        raise InputError(f"the parts have {share:.2f} times the whole's volume; are they its parts, in the same unit?")
    warnings = []
    if abs(share - 1) > SPARE:
        warnings.append(
            f"the parts have {share:.2f} times the whole's volume; are all of them there, in the same unit?"
        )
    random = np.random.default_rng(seed)
    parts = [Part(body) for body in bodies]
    places: dict[int, Place] = {}
    with tqdm(disable=not progress, desc="assemble", unit="part", leave=False) as bar:
        for _ in range(ROUNDS):
            doubtful = [i for i in range(len(parts)) if i not in places or places[i].score < POOR]
            if not doubtful:
                break
            kept = {i: place for i, place in places.items() if i not in doubtful}
            places = _fill(parts, Docking(whole, random), kept, bar)
    found = [places[i] for i in range(len(parts))]
    start = Start(*(torch.from_numpy(np.stack(x)) for x in ([p.rotation for p in found], [p.centre for p in found])))
    for body, place in zip(bodies, found, strict=True):
        if place.score < POOR:
            warnings.append(f"{body.name} lies doubtfully: {place.score:.2f} of 1 for its surface")
    return Assembly(list(bodies), whole, start, np.array([place.score for place in found]), warnings)


def _fill(parts: Sequence[Part], docking: Docking, kept: dict[int, Place], bar: tqdm) -> dict[int, Place]:
    """Places for all parts; those in `kept` have theirs."""
    places = dict(kept)
    for i, place in kept.items():
        docking.put(parts[i], place)
    rest = sorted(set(range(len(parts))) - set(kept), key=lambda i: -parts[i].body.volume)
    while rest:
        tried = {i: docking.places(parts[i]) for i in rest[: LOOKED_AT if len(rest) > 1 else 1]}
        tried = {i: found for i, found in tried.items() if found}
        if not tried:
            raise InputError(f"{parts[rest[0]].body.name} fits nowhere in the whole; is it a part of it?")
        chosen = max(tried, key=lambda i: _clearness(tried[i]))
        places[chosen] = tried[chosen][0]
        docking.put(parts[chosen], places[chosen])
        rest.remove(chosen)
        bar.update()
    for _ in range(SWEEPS):
        for k, (part, place) in enumerate(docking.placed):
            docking.placed[k] = part, docking.draw_in(part, place)
    drawn = {id(part): place for part, place in docking.placed}
    return {i: drawn[id(part)] for i, part in enumerate(parts)}


def _clearness(found: Sequence[Place]) -> float:
    """How clear it is that the first place is the right one."""
    lead = found[0].score - max(found[1].score if len(found) > 1 else 0.0, 0.0)
    return min(lead, CLEAR) + found[0].score / 2
