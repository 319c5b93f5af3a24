"""Threads by which a heap's objects hang: one or two an object, straight up, that cross nothing.

A thread ends at the plate above, or below an object that hangs higher, as in a mobile: what is below others hangs from
them. All threads are vertical, so that all forces are. An object is in balance where the middle of its weight and of
what hangs on it lies between its two threads, or under its one thread; it stays so where they hold it above that
middle. Two threads keep it from turning about them, one does not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import manifold3d
import numpy as np
import trimesh

from ..exact.placing import placed_solid
from ..geometry.meshes import Body
from ..util import o3d

DIRECTIONS = 24  # of the line from one thread to the other, over half a turn
DISTANCES = 16  # places for a thread along such a line, to either side, as far as the object's longest edge
STEEPEST = 0.1  # least height of the normal where a thread is fixed, of a normal that points straight up
ROUND = 12  # sides of a thread
NO_LENGTH = 0.01  # of its radius: a thread that is shorter joins what touches
SKIN = 1e-5  # of an object's longest edge: a thread is followed up from so far above it
HELD_ABOVE = 0.02  # of an object's longest edge: how far above the middle of the weight its threads hold it, at least
BELOW_OTHERS = 0.5  # times as good: a thread that ends at another object
HARDLY_SEEN = 0.1  # of an object's longest edge: less that is seen of two threads is no matter
LOOKED_AT = 24  # places along a thread, where it may be seen
ORDERS = 6  # in which bodies are hung, at most
TRIED = 40  # pairs of threads of an object, the best first, that are proven to cross nothing; then a single one


@dataclass(frozen=True)
class Thread:
    """From a place on an object straight up to the plate, or to the underside of another object; of no length where the
    two touch there.

    body : number of the object that it holds. above : that of the object it ends at, None for the plate. low, high :
    `(3,)` metres. load : what it carries, in cubic metres of the objects' material.
    """

    body: int
    above: int | None
    low: np.ndarray
    high: np.ndarray
    load: float

    @property
    def length(self) -> float:
        """Metres."""
        return float(self.high[2] - self.low[2])

    def solid(self, radius: float) -> manifold3d.Manifold:
        """As a rod; nothing where it has hardly a length."""
        if self.length < NO_LENGTH * radius:
            return manifold3d.Manifold()
        return manifold3d.Manifold.cylinder(self.length, radius, circular_segments=ROUND).translate(self.low)


class End(NamedTuple):
    """Where a thread may begin and end, as `Thread` has it, and how many metres of it are seen, of all views."""

    low: np.ndarray
    high: np.ndarray
    above: int | None
    seen: float


def find_threads(
    bodies: Sequence[Body],
    matrices: np.ndarray,
    top: float,
    radius: float,
    seen: Callable[[np.ndarray], np.ndarray] | None = None,
) -> tuple[list[Thread], list[int]]:
    """Threads of a radius for all bodies, placed by `matrices` `(N, 4, 4)` (file coordinates to the world), from a
    plate whose underside is at height `top`, metres; and the numbers of bodies that none in balance hold.

    seen : in how many views points `(P, 3)` would be seen, `(P,)`; in none if None. What is seen less is better.
    """
    seen = (lambda points: np.zeros(len(points))) if seen is None else seen
    search, first, alone = _Search(bodies, matrices, top, radius, seen), [], []
    for _ in range(ORDERS):
        first = [*alone, *(i for i in first if i not in alone)]
        alone = search.run(first)
        if not alone:
            break
    return search.threads, alone


class _Search:
    """Threads so far. What hangs on a body has to be known before the body hangs itself: the lowest come first, but for
    those that found nothing when others had hung before."""

    def __init__(self, bodies: Sequence[Body], matrices: np.ndarray, top: float, radius: float, seen: Callable) -> None:
        self.top, self.radius, self.seen = top, radius, seen
        self.solids = [placed_solid(body, matrix) for body, matrix in zip(bodies, matrices, strict=True)]
        meshes = [trimesh.Trimesh(*surface_of(solid), process=False) for solid in self.solids]
        self.reach = [float(np.ptp(mesh.vertices, axis=0).max()) for mesh in meshes]
        surfaces = [(mesh.vertices, mesh.faces) for mesh in meshes]
        self.scene, self.scenes = o3d.caster(surfaces), [o3d.caster([surface]) for surface in surfaces]
        self.weights = np.array([mesh.volume for mesh in meshes])
        self.centres = np.array([mesh.center_mass for mesh in meshes])

    def run(self, first: Sequence[int]) -> list[int]:
        """Threads for all, these bodies first; the numbers of those that none hold. load, middle : what each carries,
        its own weight too, and where the middle of that is."""
        self.load, self.middle = self.weights.copy(), self.centres.copy()
        self.done: set[int] = set()
        self.threads: list[Thread] = []
        rest = [i for i in np.argsort(self.centres[:, 2]).tolist() if i not in first]
        return [i for i in (*first, *rest) if not self.hang(i)]

    def hang(self, i: int) -> bool:
        """Threads for body i; False if none hold it."""
        self.done.add(i)
        for threads in self._held(i):
            if all(self._crosses_nothing(thread) for thread in threads):
                for thread in threads:
                    self._carry(thread)
                self.threads += threads
                return True
        return False

    def _carry(self, thread: Thread) -> None:
        """The load of a thread on the body at which it ends."""
        j = thread.above
        if j is not None:
            whole = self.load[j] + thread.load
            self.middle[j] = (self.load[j] * self.middle[j] + thread.load * thread.high) / whole
            self.load[j] = whole

    def _held(self, i: int) -> list[list[Thread]]:
        """Two threads each that hold body i in balance, the best first; then a single one."""
        angles = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
        steps = np.arange(-DISTANCES, DISTANCES + 1) / DISTANCES * self.reach[i]
        lines = np.stack([np.cos(angles), np.sin(angles)], 1)[:, None] * steps[:, None]
        places = [self._ends(i, self.middle[i, :2] + line) for line in lines]
        found = []
        for ends in places:
            at = {k: end for k, end in enumerate(ends) if end is not None}
            for a in (k for k in at if k < DISTANCES):
                for b in (k for k in at if k > DISTANCES):
                    found.append(self._pair(i, at[a], at[b], abs(steps[a]), abs(steps[b])))
        pairs = sorted((one for one in found if one is not None), key=lambda one: -one[0])[:TRIED]
        return [*(threads for _, threads in pairs), *self._single(i, places[0][DISTANCES])]

    def _pair(
        self, i: int, first: End, second: End, to_first: float, to_second: float
    ) -> tuple[float, list[Thread]] | None:
        """How good two threads are, and these; None if they hold the body too low."""
        share = to_second / (to_first + to_second)  # of the load on the first
        if self._too_low(i, share * first.low[2] + (1 - share) * second.low[2]):
            return None
        threads = [
            Thread(i, end.above, end.low, end.high, self.load[i] * part)
            for end, part in ((first, share), (second, 1 - share))
        ]
        good = min(to_first, to_second) * np.prod([BELOW_OTHERS if t.above is not None else 1.0 for t in threads])
        return good / (HARDLY_SEEN * self.reach[i] + first.seen + second.seen), threads

    def _single(self, i: int, end: End | None) -> list[list[Thread]]:
        if end is None or self._too_low(i, end.low[2]):
            return []
        return [[Thread(i, end.above, end.low, end.high, self.load[i])]]

    def _too_low(self, i: int, height: float) -> bool:
        """Whether body i turns over if threads hold it at a height over the middle of what it carries."""
        return height < self.middle[i, 2] + HELD_ABOVE * self.reach[i]

    def _ends(self, i: int, places: np.ndarray) -> list[End | None]:
        """For each of places `(P, 2)` in plan: where a thread is fixed on body i, where it ends, and at which body;
        None where there is none."""
        tensor, clear = o3d.load().core.Tensor, SKIN * self.reach[i]
        down = np.column_stack([places, np.full(len(places), self.top), np.tile([0, 0, -1.0], (len(places), 1))])
        hit = self.scenes[i].cast_rays(tensor(down.astype(np.float32)))
        depth, normals = hit["t_hit"].numpy().astype(np.float64), hit["primitive_normals"].numpy()
        fixed = np.column_stack([places, self.top - depth])
        good = np.isfinite(depth) & (np.abs(normals[:, 2]) > STEEPEST)
        fixed[~good] = 0
        start = fixed + np.array([0, 0, clear])
        up = np.column_stack([start, np.tile([0, 0, 1.0], (len(places), 1))])
        met = self.scene.cast_rays(tensor(up.astype(np.float32)))
        distance, which = met["t_hit"].numpy().astype(np.float64), met["geometry_ids"].numpy()
        from_below = met["primitive_normals"].numpy()[:, 2] < 0
        found = []
        for k, low in enumerate(fixed):
            open_above = not np.isfinite(distance[k])
            above = None if open_above else int(which[k])
            if not good[k] or above in self.done:
                found.append(None)
                continue
            # what it touches, and so begins in by a hair, it ends at
            length = clear + distance[k] if from_below[k] else 0.0
            high = self.top if open_above else low[2] + length
            found.append(End(low, np.array([low[0], low[1], high]), above, 0.0))
        there = [k for k, end in enumerate(found) if end is not None]
        for k, seen in zip(there, self._seen([found[k] for k in there]), strict=True):
            found[k] = found[k]._replace(seen=float(seen))
        return found

    def _seen(self, ends: Sequence[End]) -> np.ndarray:
        """`(E,)` metres of threads that are seen."""
        along = (np.arange(LOOKED_AT) + 0.5)[:, None] / LOOKED_AT
        points = np.concatenate([np.zeros((0, 3)), *(end.low + along * (end.high - end.low) for end in ends)])
        lengths = np.array([end.high[2] - end.low[2] for end in ends])
        return self.seen(points).reshape(-1, LOOKED_AT).mean(1) * lengths

    def _crosses_nothing(self, thread: Thread) -> bool:
        """By exact booleans, but for the two that it joins; and whether it keeps clear of other threads."""
        rod, apart = thread.solid(self.radius), 2 * self.radius
        for other in self.threads:
            beside = np.linalg.norm(other.low[:2] - thread.low[:2]) < apart
            if beside and other.low[2] < thread.high[2] and thread.low[2] < other.high[2]:
                return False
        box = np.array(rod.bounding_box())
        for j, solid in enumerate(self.solids):
            if j in (thread.body, thread.above):
                continue
            theirs = np.array(solid.bounding_box())
            if (box[:3] < theirs[3:]).all() and (theirs[:3] < box[3:]).all() and not (rod ^ solid).is_empty():
                return False
        return True


def surface_of(solid: manifold3d.Manifold) -> tuple[np.ndarray, np.ndarray]:
    """Vertices `(V, 3)` and faces `(F, 3)`."""
    mesh = solid.to_mesh64()
    return np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, np.int64)
