"""Struts that join solids into one and that no view sees: a spanning tree over shortest hidden paths.

The solids' inner points spread through the hidden space on a lattice (Dijkstra from all at once); where the regions of
two solids meet, a path joins them (Mehlhorn 1988, A faster approximation algorithm for the Steiner problem in graphs).
Paths are pulled straight, made as thick as they may be, and taken by length until all hangs together.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import manifold3d
import numpy as np
from scipy.cluster.hierarchy import DisjointSet
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

STEPS = np.array([s for s in itertools.product((-1, 0, 1), repeat=3) if s > (0, 0, 0)])  # to half of the neighbours
ROUND = 24  # sides of a strut
SPARE = 1.02  # of a radius, by which a round solid of so many sides is larger
SHORT = 12.0  # least radii beyond what reaches into both solids: a joint so short is made though the tree needs none
THICKEST = 2.0  # least radii that a strut may have
POINTS_A_STEP = 4  # places on each lattice step of a strut where it is looked at


@dataclass(frozen=True)
class Strut:
    """A round rod along a polyline. first, second : the solids that it joins. points `(P, 3)`, radius : metres."""

    first: int
    second: int
    points: np.ndarray
    radius: float

    @property
    def length(self) -> float:
        """Metres, from end to end."""
        return _length(self.points)

    def solid(self) -> manifold3d.Manifold:
        """Rods with round ends, whose radius is `radius` at least all round."""
        ball = manifold3d.Manifold.sphere(SPARE * self.radius, ROUND)
        rods = [
            manifold3d.Manifold.batch_hull([ball.translate(a), ball.translate(b)])
            for a, b in itertools.pairwise(self.points)
        ]
        return manifold3d.Manifold.batch_boolean(rods, manifold3d.OpType.Add)


def find_struts(
    anchors: Sequence[np.ndarray],
    clearance: Callable[[np.ndarray], np.ndarray],
    radius: float,
    margin: float,
    spacing: float,
    low: np.ndarray,
    high: np.ndarray,
    joined: Sequence[tuple[int, int]] = (),
) -> tuple[list[Strut], list[int]]:
    """Struts that join N solids, and the solids that none reaches, those of the largest joined group not among them.

    anchors : for each solid points `(A, 3)` in it, at which struts may end. clearance : of points `(P, 3)`, how large a
    hidden ball there is, metres. radius : least, of a strut; margin : kept to what is seen. spacing : of the lattice,
    in the box from `low` to `high` `(3,)`. joined : pairs of solids that are one without a strut.
    """
    need = SPARE * radius + margin
    lattice = _Lattice(anchors, clearance, need, spacing, low, high)
    groups, struts = DisjointSet(range(len(anchors))), []
    for first, second in joined:
        groups.merge(int(first), int(second))
    short = SHORT * radius
    for first, second, path in lattice.paths():
        apart = not groups.connected(first, second)
        if not apart and _length(path) > short + 2 * radius:
            continue
        points = _straightened(path, clearance, need, spacing)
        room = clearance(_along(points, spacing)).min()
        if room < need - margin / 2 or (not apart and _length(points) > short + 2 * radius):
            continue
        groups.merge(first, second)
        struts.append(Strut(first, second, points, min((room - margin) / SPARE, THICKEST * radius)))
    largest = max(groups.subsets(), key=len)
    return struts, sorted(set(range(len(anchors))) - largest)


class _Lattice:
    """Hidden places on a lattice and the solids' anchors, and from each the way to the nearest solid."""

    def __init__(self, anchors, clearance, need: float, spacing: float, low, high):
        shape = np.ceil((np.asarray(high) - low) / spacing).astype(int) + 1
        index = np.indices(shape).reshape(3, -1).T
        places = low + spacing * index
        free = clearance(places) >= need
        number = np.full(shape, -1)
        number.reshape(-1)[free] = np.arange(free.sum())
        self.places = places[free]
        edges = [np.zeros((0, 2), int)]
        for step in STEPS:
            a, b = (
                number[tuple(slice(max(s * d, 0), n + min(s * d, 0)) for d, n in zip(step, shape, strict=True))]
                for s in (-1, 1)
            )
            both = (a >= 0) & (b >= 0)
            pairs = np.column_stack([a[both], b[both]])
            edges.append(pairs[clearance((self.places[pairs[:, 0]] + self.places[pairs[:, 1]]) / 2) >= need])
        count = len(self.places)
        kept = [points[clearance(points) >= need] for points in anchors]
        self.owner = np.repeat(np.arange(len(kept)), [len(points) for points in kept])
        ends = np.concatenate([np.zeros((0, 3)), *kept])
        cell = np.floor((ends - low) / spacing).astype(int)
        for corner in itertools.product((0, 1), repeat=3):
            near = (cell + corner).clip(0, shape - 1)
            at = number[tuple(near.T)]
            edges.append(np.column_stack([count + np.flatnonzero(at >= 0), at[at >= 0]]))
        self.places = np.concatenate([self.places, ends])
        self.edges = np.concatenate(edges)
        self.sources = count + np.arange(len(ends))

    def paths(self) -> Iterator[tuple[int, int, np.ndarray]]:
        """Two solids and a path `(P, 3)` from one to the other, for each two whose regions meet, the shortest first."""
        if not len(self.sources):
            return
        a, b = self.edges.T
        length = np.linalg.norm(self.places[a] - self.places[b], axis=1) + 1e-12
        graph = coo_matrix((length, (a, b)), (len(self.places),) * 2).tocsr()
        far, back, source = dijkstra(
            graph, directed=False, indices=self.sources, return_predecessors=True, min_only=True
        )
        reached = source >= 0
        solid = np.where(reached, self.owner[np.where(reached, source, self.sources[0]) - self.sources[0]], -1)
        meets = (solid[a] != solid[b]) & reached[a] & reached[b]
        a, b, total = a[meets], b[meets], (far[a] + length + far[b])[meets]
        done = set()
        for k in np.argsort(total, kind="stable"):
            pair = tuple(sorted((int(solid[a[k]]), int(solid[b[k]]))))
            if pair in done:
                continue
            done.add(pair)
            path = [*self._way(a[k], back)[::-1], *self._way(b[k], back)]
            yield int(solid[a[k]]), int(solid[b[k]]), self.places[path]

    @staticmethod
    def _way(node: int, back: np.ndarray) -> list[int]:
        found = [int(node)]
        while back[found[-1]] >= 0:
            found.append(int(back[found[-1]]))
        return found


def _straightened(path: np.ndarray, clearance, need: float, spacing: float) -> np.ndarray:
    """The path with its corners left out where what joins the others stays hidden, those farthest apart first."""
    kept, at = [0], 0
    while at < len(path) - 1:
        for far in range(len(path) - 1, at, -1):
            if far == at + 1 or clearance(_along(path[[at, far]], spacing)).min() >= need:
                kept.append(far)
                at = far
                break
    return path[kept]


def _along(points: np.ndarray, spacing: float) -> np.ndarray:
    """Points on a polyline, closer than a lattice step."""
    found = [points[-1:]]
    for a, b in itertools.pairwise(points):
        count = max(int(np.ceil(np.linalg.norm(b - a) / spacing * POINTS_A_STEP)), 1)
        found.append(a + (b - a) * (np.arange(count) / count)[:, None])
    return np.concatenate(found)


def _length(points: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
