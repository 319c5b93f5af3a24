"""An assembly that grows from pieces alone: pairs are matched by their creases, and joined best first.

What joins two pieces is seldom certain, but a wrong pose seldom fits a third piece, too. So assemblies grow from many
pairs, each by the piece and the pose that gain most; of the best one parts are taken out and grown anew.
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
from .completion import Completion, Growth, Options
from .crease_matching import Piece, Target
from .joints import Fits
from .scored_poses import ScoredPose, stack, unstack


@dataclass(frozen=True)
class GrowingSettings:
    """tried : poses of each pair that are tried, the best; listed : of each further piece, at once.

    starts : pairs from which assemblies grow, times the number of pieces; retries : growths of parts of the best one
    that fail, times the number of pieces, after which that ends. luck : the spread of the random factors of gains, that
    make each growth another one. draws : steps by which a piece that is added is drawn in; sweeps : in which all are,
    as long as each gains `gained` crease points. least_share : of a piece's crease points, what it must gain to be
    placed; least_points : at least. foreign, foreign_meets : a piece belongs to none if it adds less, and less of it
    coincides, for each of its crease points, in medians of all pieces. apart : as for poses of a pair. surface_sweeps :
    in which each piece is drawn in by surfaces between all others; kept_share : of the coinciding creases that must be
    left then.
    """

    tried: int = 12
    listed: int = 40
    starts: int = 2
    retries: int = 3
    luck: float = 0.25
    draws: int = 3
    sweeps: int = 3
    gained: float = 0.5
    least_share: float = 0.05
    least_points: float = 5.0
    foreign: float = 0.3
    foreign_meets: float = 0.5
    apart_rad: float = 0.1
    apart_spacings: float = 4.0
    surface_sweeps: int = 3
    kept_share: float = 0.8


SETTINGS = GrowingSettings()


def relative(root: ScoredPose, pose: ScoredPose) -> ScoredPose:
    """A pose as seen from another one."""
    turn = root.rotation.T
    return replace(pose, rotation=turn @ pose.rotation, translation=turn @ (pose.translation - root.translation))


def after(root: ScoredPose, pose: ScoredPose) -> ScoredPose:
    """The pose that is `pose` as seen from `root`."""
    there = root.rotation @ pose.translation + root.translation
    return replace(pose, rotation=root.rotation @ pose.rotation, translation=there)


def _turned_round(pose: ScoredPose) -> ScoredPose:
    """How what lies at the origin is seen from the pose."""
    return replace(relative(pose, ScoredPose(np.eye(3), np.zeros(3))), score=pose.score)


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
        self.beside = {(j, i): [_turned_round(pose) for pose in poses] for (i, j), poses in self.pairs.items()}
        self.beside |= self.pairs
        self.fits = Fits(self.pieces)

    def _match(self, i: int, j: int) -> list[ScoredPose]:
        random = np.random.default_rng([self.seed, i, j])
        return crease_matching.find_poses(self.pieces[j], self.pieces[i].target, random)

    def grow(self) -> Growth:
        """The assembly with the best score that is found: some pieces may be in none."""
        random, size = np.random.default_rng(self.seed), len(self.pieces)
        pairs = [(pose, i, j) for (i, j), poses in self.pairs.items() for pose in poses[: SETTINGS.tried]]
        pairs = [pair for pair in pairs if pair[0].score > self.least(*pair[1:])]
        pairs = sorted(pairs, key=lambda pair: -pair[0].score)[: SETTINGS.starts * size]
        best = Growth({}, 0.0)
        for chance in (None, random):
            for pose, i, j in pairs:
                found = self.complete({i: ScoredPose(np.eye(3), np.zeros(3)), j: pose}, chance)
                best = max(best, found, key=lambda growth: growth.score)
        failed = 0
        while failed < SETTINGS.retries * size and len(best.poses) > 2:
            kept = self._cluster(best, int(random.integers(1, len(best.poses) - 1)), random)
            found = self.complete({k: best.poses[k] for k in kept}, random)
            better = found.score > best.score + SETTINGS.gained
            best, failed = (found, 0) if better else (best, failed + 1)
        return best

    def complete(self, poses: Mapping[int, ScoredPose], random: np.random.Generator | None = None) -> Growth:
        """Add the pieces that are not there, as long as any gains enough, and draw all in; by luck, too, if `random` is
        given."""
        state, fresh = Completion(self.fits, poses), list(poses)
        options = {j: Options(*stack([]), {}, np.zeros(0)) for j in range(len(self.pieces)) if j not in poses}
        while options:
            options = {j: self._options(state, j, known, fresh, random) for j, known in options.items()}
            gains = {
                j: known.luck[0] * state.gains(j, known.joints)[0] for j, known in options.items() if len(known.luck)
            }
            j = max(gains, key=lambda j: gains[j], default=None)
            if j is None or gains[j] <= self.least(j):
                break
            first = options.pop(j).taken(np.array([0]))
            pose = ScoredPose(first.rotation[0], first.translation[0])
            drawn = self._drawn(j, pose, state.poses)
            closer = state.joints(j, *stack([drawn]))
            if state.gains(j, closer)[0] > state.gains(j, first.joints)[0]:
                state.add(j, drawn, closer)
            else:
                state.add(j, pose, first.joints)
            fresh = [j]
        return self._settled(state.growth)

    def _options(
        self, state: Completion, j: int, known: Options, fresh: Sequence[int], random: np.random.Generator | None
    ) -> Options:
        """Poses of a piece beside placed ones, the best first: the known ones, and those beside `fresh` ones."""
        meeting = state.joints(j, known.rotation, known.translation, fresh)
        known = replace(known, joints={**known.joints, **meeting})
        new = [after(state.poses[i], pose) for i in fresh for pose in self.beside[i, j][: SETTINGS.tried]]
        rotation, translation = stack(new)
        luck = np.ones(len(new)) if random is None else np.exp(SETTINGS.luck * random.normal(size=len(new)))
        known = known.joined(Options(rotation, translation, state.joints(j, rotation, translation), luck))
        known = known.taken(np.argsort(-known.luck * state.gains(j, known.joints), kind="stable"))
        return known.distinct(SETTINGS.apart_rad, self.apart, SETTINGS.listed)

    def _cluster(self, state: Growth, count: int, random: np.random.Generator) -> list[int]:
        """Pieces that hang together well, `count` of them at most, from one that is picked at random."""
        placed = list(state.poses)
        kept = [placed[random.integers(len(placed))]]
        while len(kept) < count:
            rest = [k for k in placed if k not in kept]
            worth = np.array([sum(self._worth(state.poses, i, k) for i in kept) for k in rest]) + 1e-3
            kept.append(rest[random.choice(len(rest), p=worth / worth.sum())])
        return kept

    def _worth(self, poses: Mapping[int, ScoredPose], i: int, j: int) -> float:
        return max(float(self.fits.between(i, j, *stack([relative(poses[i], poses[j])])).worth[0]), 0.0)

    def _settled(self, grown: Growth) -> Growth:
        """Each piece but the first drawn in, by its creases, between all others, as long as the score rises."""
        best = grown
        for _ in range(SETTINGS.sweeps):
            poses = dict(best.poses)
            for j in list(poses)[1:]:
                poses[j] = self._drawn(j, poses[j], poses)
            found = Completion(self.fits, poses).growth
            if found.score < best.score + SETTINGS.gained:
                break
            best = found
        return best

    def _drawn(self, j: int, pose: ScoredPose, poses: Mapping[int, ScoredPose]) -> ScoredPose:
        """The pose after steps by which creases of piece j that match those of placed pieces come together."""
        others = [(self.pieces[i], there) for i, there in poses.items() if i != j]
        for _ in range(SETTINGS.draws):
            pose = crease_matching.drawn_between(self.pieces[j], pose, others)
        return pose

    def least(self, *pieces: int) -> float:
        """How many crease points of one of these pieces must coincide with others', that it belongs to them."""
        few = min(len(self.pieces[k].creases.points) for k in pieces)
        return max(SETTINGS.least_points, SETTINGS.least_share * few)

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
        poses = dict(self._settled(state).poses)
        still = max(poses, key=lambda k: self.pieces[k].body.volume)
        for _ in range(SETTINGS.surface_sweeps):
            for j in sorted(set(poses) - {still}):
                others = [i for i in poses if i != j]
                target = Target([self.pieces[i] for i in others], [poses[i] for i in others])
                pressed = crease_matching.pressed(self.pieces[j], target, *stack([poses[j]]))
                tried = [poses[j], *unstack(*pressed, np.zeros(1))]
                now, then = crease_matching.scored(self.pieces[j], target, tried)
                # surfaces say more exactly where a piece lies than worn creases do
                poses[j] = then if then.score >= SETTINGS.kept_share * now.score else now
        return Completion(self.fits, poses).growth

    def without_foreign(self, state: Growth) -> Growth:
        """The assembly without pieces that join it far worse than its pieces do in the median; three at least stay.

        Such a piece adds little to the score, and few of its crease points coincide, each as a share of these points. A
        large piece with edges of its own may add little, too, but much of it coincides.
        """
        while len(state.poses) > 3:
            shares = np.array([self._shares(state, j) for j in state.poses])
            adds, meets = (shares / np.median(shares, axis=0)).T
            doubtful = np.where((adds < SETTINGS.foreign) & (meets < SETTINGS.foreign_meets), adds, np.inf)
            if np.isinf(doubtful).all():
                break
            left = set(state.poses) - {list(state.poses)[int(doubtful.argmin())]}
            state = Completion(self.fits, {k: state.poses[k] for k in sorted(left)}).growth
        return state

    def _shares(self, state: Growth, j: int) -> tuple[float, float]:
        """What a piece adds to the score, and how many of its crease points coincide, for each of them."""
        without = Completion(self.fits, {k: pose for k, pose in state.poses.items() if k != j}).growth
        points = max(len(self.pieces[j].creases.points), 1)
        return (state.score - without.score) / points, state.poses[j].score / points
