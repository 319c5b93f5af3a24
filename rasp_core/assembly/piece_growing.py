"""An assembly that grows from pieces alone: pairs are matched by their creases, and joined best first.

What joins two pieces is seldom certain, but a wrong pose seldom fits a third piece, too. So several assemblies grow at
once, each by the piece and the pose that makes most of the creases coincide with those of all pieces that are there.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from tqdm.auto import tqdm

from ..geometry.meshes import Body
from . import crease_matching
from .crease_matching import Piece, Target
from .scored_poses import ScoredPose, best_first, distinct, stack, unstack


@dataclass(frozen=True)
class GrowingSettings:
    """beam : assemblies that are followed, and steps that are taken from each; tried : poses of each further piece.
    least_share : of the weight of a piece's creases, what its score must be for the piece to belong to others;
    least_points : how much at least.
    apart : as for poses of a pair. sweeps : in which each piece is refined between all others, by creases, each time by
    crease_steps, then by surfaces; kept_share : of the coinciding creases that must be left then."""

    beam: int = 6
    tried: int = 24
    least_share: float = 0.18
    least_points: float = 5.0
    apart_rad: float = 0.1
    apart_spacings: float = 4.0
    crease_sweeps: int = 1
    crease_steps: int = 4
    surface_sweeps: int = 3
    kept_share: float = 0.8


SETTINGS = GrowingSettings()


@dataclass(frozen=True)
class Growth:
    """Pieces that belong together: poses by their numbers, and how many crease points coincide, less the penalties."""

    poses: Mapping[int, ScoredPose]
    score: float


def relative(root: ScoredPose, pose: ScoredPose) -> ScoredPose:
    """A pose as seen from another one."""
    turn = root.rotation.T
    return replace(pose, rotation=turn @ pose.rotation, translation=turn @ (pose.translation - root.translation))


def after(root: ScoredPose, pose: ScoredPose) -> ScoredPose:
    """The pose that is `pose` as seen from `root`."""
    there = root.rotation @ pose.translation + root.translation
    return replace(pose, rotation=root.rotation @ pose.rotation, translation=there)


class Growing:
    """All pieces, and the poses of each beside each other one."""

    def __init__(self, bodies: Sequence[Body], seed: int = 0, bar: tqdm | None = None):
        spacing = crease_matching.spacing_of(bodies)
        self.seed, self.apart = seed, SETTINGS.apart_spacings * spacing
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            self.pieces = list(pool.map(lambda body: Piece(body, spacing), bodies))
            pairs = list(combinations(range(len(bodies)), 2))
            found = []
            for poses in pool.map(lambda pair: self._match(*pair), pairs):
                found.append(poses)
                if bar is not None:
                    bar.update()
        self.pairs = dict(zip(pairs, found, strict=True))

    def _match(self, i: int, j: int) -> list[ScoredPose]:
        random = np.random.default_rng([self.seed, i, j])
        return crease_matching.find_poses(self.pieces[j], self.pieces[i].target, random)

    def gain(self, poses: Mapping[int, ScoredPose], j: int, tried: Sequence[ScoredPose]) -> np.ndarray:
        """`(B,)`: how many crease points of piece j coincide with those of placed pieces, less the penalties."""
        total = np.zeros(len(tried))
        for i, there in poses.items():
            if i == j:
                continue
            seen = [relative(there, pose) for pose in tried]
            reach = self.pieces[i].body.radius + self.pieces[j].body.radius
            near = [k for k, pose in enumerate(seen) if np.linalg.norm(pose.translation) < reach]
            found = crease_matching.scored(self.pieces[j], self.pieces[i].target, [seen[k] for k in near])
            total[near] += [pose.score for pose in found]
        return total

    def grow(self) -> Growth:
        """The assembly of most coinciding creases: some pieces may be in none."""
        firsts = [
            Growth({i: ScoredPose(np.eye(3), np.zeros(3)), j: pose}, pose.score)
            for (i, j), poses in self.pairs.items()
            for pose in poses
            if pose.score > self.least(i, j)
        ]
        states = self._best(firsts)
        if not states:
            return Growth({}, 0.0)
        ended = []
        while states:
            steps = []
            for state in states:
                further = self._steps(state)
                steps += further
                if not further:
                    ended.append(state)
            states = self._best(steps)
        return max(ended, key=lambda state: (state.score, len(state.poses)))

    def least(self, *pieces: int) -> float:
        """How many crease points of one of these pieces must coincide with others', that it belongs to them."""
        few = min(self.pieces[k].weight for k in pieces)
        return max(SETTINGS.least_points, SETTINGS.least_share * few)

    def _steps(self, state: Growth) -> list[Growth]:
        """The best ways to add one piece."""
        found = []
        for j in set(range(len(self.pieces))) - set(state.poses):
            tried = [after(state.poses[i], pose) for i in state.poses for pose in self._beside(i, j)]
            tried = distinct(best_first(tried), SETTINGS.tried, SETTINGS.apart_rad, self.apart)
            gains = self.gain(state.poses, j, tried)
            for k in np.argsort(-gains, kind="stable")[: SETTINGS.beam]:
                if gains[k] > self.least(j):
                    pose = replace(tried[k], score=float(gains[k]))
                    found.append(Growth({**state.poses, j: pose}, state.score + pose.score))
        return found

    def _beside(self, i: int, j: int) -> list[ScoredPose]:
        """Poses of piece j, as seen from piece i."""
        if i < j:
            return self.pairs[i, j]
        unit = ScoredPose(np.eye(3), np.zeros(3))
        return [replace(relative(pose, unit), score=pose.score) for pose in self.pairs[j, i]]

    def _best(self, states: Sequence[Growth]) -> list[Growth]:
        kept: list[Growth] = []
        for state in sorted(states, key=lambda state: -state.score):
            if not any(self._same(state, other) for other in kept):
                kept.append(state)
                if len(kept) == SETTINGS.beam:
                    break
        return kept

    def _same(self, one: Growth, other: Growth) -> bool:
        if set(one.poses) != set(other.poses):
            return False
        root = min(one.poses)
        return not any(
            relative(one.poses[root], one.poses[k]).differs(
                relative(other.poses[root], other.poses[k]), SETTINGS.apart_rad, self.apart
            )
            for k in one.poses
        )

    def add_missing(self, state: Growth) -> Growth:
        """Match each piece that is in no pair anew, beside all that are placed, as long as one is found."""
        while True:
            rest = sorted(set(range(len(self.pieces))) - set(state.poses))
            placed = sorted(state.poses)
            if not rest or not placed:
                return state
            target = Target([self.pieces[i] for i in placed], [state.poses[i] for i in placed])
            best, which = None, None
            for j in rest:
                random = np.random.default_rng([self.seed, len(placed), j])
                found = crease_matching.find_poses(self.pieces[j], target, random)
                if found and found[0].score > self.least(j) and (best is None or found[0].score > best.score):
                    best, which = found[0], j
            if best is None:
                return state
            state = Growth({**state.poses, which: best}, state.score + best.score)

    def refined(self, state: Growth) -> Growth:
        """Each piece but the largest drawn in between all others, first by creases, then by surfaces."""
        poses = dict(state.poses)
        still = max(poses, key=lambda k: self.pieces[k].body.volume)
        for sweep in range(SETTINGS.crease_sweeps + SETTINGS.surface_sweeps):
            for j in sorted(set(poses) - {still}):
                others = [i for i in poses if i != j]
                target = Target([self.pieces[i] for i in others], [poses[i] for i in others])
                rotation, translation = stack([poses[j]])
                if sweep < SETTINGS.crease_sweeps:
                    for _ in range(SETTINGS.crease_steps):
                        rotation, translation = crease_matching.drawn_in(self.pieces[j], target, rotation, translation)
                else:
                    rotation, translation = crease_matching.pressed(self.pieces[j], target, rotation, translation)
                tried = [poses[j], *unstack(rotation, translation, np.zeros(1))]
                now, then = crease_matching.scored(self.pieces[j], target, tried)
                # surfaces say more exactly where a piece lies than worn creases do
                least = now.score if sweep < SETTINGS.crease_sweeps else SETTINGS.kept_share * now.score
                poses[j] = then if then.score >= least else now
        for j, pose in poses.items():
            poses[j] = replace(pose, score=float(self.gain(poses, j, [pose])[0]))
        return Growth(poses, sum(pose.score for pose in poses.values()) / 2)
