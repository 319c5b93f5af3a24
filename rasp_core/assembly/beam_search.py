"""Poses for all parts of a broken thing, one part after the other: a beam search over orders and poses.

Each part is matched to the surface of the whole and to fractures of parts already placed, most certain match first. A
part that fits at many places of the whole, as on a bowl, waits until a neighbour shows which. A step that looks best
may still be wrong, so several partial assemblies are followed, and the best by surface decides at the end.
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
from .registration import SETTINGS as REGISTRATION
from .registration import Part, PartialAssembly
from .scored_poses import ScoredPose, best_first, distinct


@dataclass(frozen=True)
class BeamSettings:
    """Of the search for all parts' poses.

    branches : poses of each part that are followed, if the whole's mesh is known and if only a hull is. beam : partial
    assemblies that are followed after a first search, with one, ended with a quality under `good_quality`; for
    `beam_parts` parts at most. hull_beam : partial assemblies times parts, in a hull. refinement_sweeps : in which each
    part is refined once more between all others. doubtful_scores : scores under which parts are searched again, round
    by round, until `vain_rounds` rounds gained less than `least_gain` of quality. size_margin : a part's certainty for
    its size alone, as a fraction of its surface. apart : poses that differ by less, in radians or in radii of the part,
    are the same.
    """

    branches: int = 2
    hull_branches: int = 20
    beam: int = 4
    beam_parts: int = 12
    hull_beam: int = 320
    good_quality: float = 0.85
    refinement_sweeps: int = 2
    doubtful_scores: tuple[float, ...] = (0.7, 0.8, 0.7, 0.8, 0.85, 0.7)
    vain_rounds: int = 2
    least_gain: float = 0.01
    size_margin: float = 0.02
    apart_rad: float = 0.1
    apart_radii: float = 0.1


SETTINGS = BeamSettings()


@dataclass(frozen=True)
class _State:
    """A partial assembly; the numbers of its parts, in the order in which they were placed; poses of the other parts,
    the best first; and the sum, in square metres of surface, by which each pose was better than its rivals."""

    assembly: PartialAssembly
    order: tuple[int, ...]
    candidates: Mapping[int, list[ScoredPose]]
    margin: float = 0.0

    def same_as(self, other: _State) -> bool:
        """Whether the same parts have the same poses."""
        theirs = dict(zip(other.order, other.assembly.placed, strict=True))
        return set(self.order) == set(other.order) and not any(
            _differ(part, pose, theirs[i][1]) for i, (part, pose) in zip(self.order, self.assembly.placed, strict=True)
        )

    @property
    def poses(self) -> list[ScoredPose]:
        """In the order of the parts."""
        placed = dict(zip(self.order, self.assembly.placed, strict=True))
        return [placed[i][1] for i in sorted(placed)]

    @property
    def quality(self) -> float:
        """The mean score of the parts, weighted by their surface."""
        areas = [part.area for part, _ in self.assembly.placed]
        return float(np.average([pose.score for _, pose in self.assembly.placed], weights=areas))


def best_assembly(bodies: Sequence[Body], whole: Container, seed: int = 0, progress: bool = False) -> list[ScoredPose]:
    """A pose for each part, and its score between all others. Raises InputError if one fits nowhere."""
    with tqdm(disable=not progress, desc="assemble", unit="part", leave=False) as bar:
        search = _Search(bodies, whole, seed, bar, SETTINGS.branches)
        best = search.improve(search.complete(search.empty, beam=1)[0])
        if best.quality < SETTINGS.good_quality and 2 < len(bodies) <= SETTINGS.beam_parts:
            wide = search.improve(search.complete(search.empty, beam=SETTINGS.beam)[0])
            best = max(best, wide, key=lambda state: state.quality)
    return best.poses


def possible_assemblies(
    bodies: Sequence[Body], hull: Container, seed: int = 0, progress: bool = False
) -> list[list[ScoredPose]]:
    """Poses for all parts within a visual hull, in many ways, for silhouettes to decide between. Raises InputError as
    `best_assembly` does."""
    with tqdm(disable=not progress, desc="assemble", unit="part", leave=False) as bar:
        search = _Search(bodies, hull, seed, bar, SETTINGS.hull_branches)
        return [state.poses for state in search.complete(search.empty, beam=max(1, SETTINGS.hull_beam // len(bodies)))]


def refine_together(bodies: Sequence[Body], hull: Container, poses: Sequence[ScoredPose]) -> list[ScoredPose]:
    """Refine each part but the largest between the others, surface to surface; the hull is only a bound."""
    assembly = PartialAssembly(hull, match_whole=False)
    for body, pose in zip(bodies, poses, strict=True):
        assembly.add(Part(body), pose)
    _refine_placed(assembly, still=int(np.argmax([body.volume for body in bodies])))
    return [pose for _, pose in assembly.placed]


@dataclass(frozen=True)
class _Query:
    """Which poses a part has in an assembly: those known before, with their scores now, and new ones, which touch the
    placed part of the number `touching` if one is given."""

    assembly: PartialAssembly
    part: int
    known: Sequence[ScoredPose] = ()
    touching: int | None = None


class _Search:
    """The parts, and the poses of each alone in the empty whole, the best first."""

    def __init__(self, bodies: Sequence[Body], whole: Container, seed: int, bar: tqdm, branches: int):
        self.parts, self.seed, self.bar, self.tries = [Part(body) for body in bodies], seed, bar, 0
        self.branches = branches
        empty = PartialAssembly(whole)
        self.alone = self._find([_Query(empty, i) for i in range(len(bodies))])
        for body, found in zip(bodies, self.alone, strict=True):
            if not found:
                raise InputError(f"{body.name} fits nowhere in the whole; is it a part of it?")
        self.empty = _State(empty, (), dict(enumerate(self.alone)))

    def _find(self, queries: Sequence[_Query]) -> list[list[ScoredPose]]:
        """The poses that each query asks for, the best first; each is random by its own seed, on a thread of many."""
        first, self.tries = self.tries, self.tries + len(queries)

        def answer(k: int) -> list[ScoredPose]:
            query, part = queries[k], self.parts[queries[k].part]
            random = np.random.default_rng([self.seed, first + k])
            known = query.assembly.rescored(part, query.known) if query.known else []
            known = [pose for pose in known if pose.score > 0]
            found = best_first([*known, *query.assembly.find_poses(part, random, query.touching)])
            apart = SETTINGS.apart_radii * part.body.radius
            return distinct(found, REGISTRATION.returned, SETTINGS.apart_rad, distance=apart)

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            return list(pool.map(answer, range(len(queries))))

    def _state(self, assembly: PartialAssembly, order: tuple[int, ...]) -> _State:
        """The state of an assembly of these parts, with poses of all others."""
        rest = [i for i in range(len(self.parts)) if i not in order]
        found = self._find([_Query(assembly, i) for i in rest])
        return _State(assembly, order, dict(zip(rest, found, strict=True)))

    def complete(self, state: _State, beam: int) -> list[_State]:
        """Place all other parts too; `beam` states are followed, and come back the best first."""
        states = [state]
        while states[0].candidates:
            # a part that fits nowhere beside the others is placed, doubtfully, where it would lie alone
            steps = [
                (state.margin + self._margin(i, pose, found), state, i, pose)
                for state in states
                for i, found in state.candidates.items()
                for pose in (found or self.alone[i])[: self.branches]
            ]
            states = []
            for margin, before, i, pose in sorted(steps, key=lambda step: -step[0]):
                assembly = before.assembly.copy()
                assembly.add(self.parts[i], pose)
                rest = {k: found for k, found in before.candidates.items() if k != i}
                state = _State(assembly, (*before.order, i), rest, margin)
                if not any(state.same_as(other) for other in states):
                    states.append(state)
                    if len(states) == beam:
                        break
            queries = [
                _Query(s.assembly, i, known, touching=len(s.order) - 1)
                for s in states
                for i, known in s.candidates.items()
            ]
            found = iter(self._find(queries))
            states = [replace(s, candidates={i: next(found) for i in s.candidates}) for s in states]
            self.bar.update()
        for state in states:
            _refine_placed(state.assembly)
        return sorted(states, key=lambda state: -state.quality)

    def improve(self, state: _State) -> _State:
        """Take doubtful parts out and search them again, as long as that makes the assembly better."""
        vain = 0
        for least in SETTINGS.doubtful_scores if len(self.parts) > 2 else ():
            if vain == SETTINGS.vain_rounds:
                break
            placed = zip(state.order, state.assembly.placed, strict=True)
            kept = [(i, part, pose) for i, (part, pose) in placed if pose.score >= least]
            if len(kept) == len(self.parts):
                continue
            assembly = self.empty.assembly.copy()
            for _, part, pose in kept:
                assembly.add(part, pose)
            again = self.complete(self._state(assembly, tuple(i for i, _, _ in kept)), beam=1)[0]
            vain = 0 if again.quality > state.quality + SETTINGS.least_gain else vain + 1
            state = max(state, again, key=lambda state: state.quality)
        return state

    def _margin(self, i: int, pose: ScoredPose, found: Sequence[ScoredPose]) -> float:
        """By how much surface, in square metres, a pose is better than the part's others, those in the empty whole
        too."""
        part = self.parts[i]
        rivals = [other.score for other in (*found, *self.alone[i]) if _differ(part, pose, other)]
        return part.area * (pose.score - max(rivals, default=0.0) + SETTINGS.size_margin)


def _differ(part: Part, one: ScoredPose, other: ScoredPose) -> bool:
    return one.differs(other, SETTINGS.apart_rad, SETTINGS.apart_radii * part.body.radius)


def _refine_placed(assembly: PartialAssembly, still: int | None = None) -> None:
    """Refine each part, but the one that is to be `still`, between all others, if that raises its score; all scores are
    those at the end."""
    for sweep in range(SETTINGS.refinement_sweeps + 1):
        for k, (part, pose) in enumerate(assembly.placed):
            now = replace(pose, score=assembly.score(part, pose))
            refined = assembly.refine(part, [now]) if sweep < SETTINGS.refinement_sweeps and k != still else []
            assembly.set_pose(k, max([now, *refined], key=lambda pose: pose.score))
