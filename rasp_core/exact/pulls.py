"""Out through a container's open top by straight pulls, one body after the other: judged exactly, along the whole way.

A container is open where it reaches its highest plane, as a box is without its lid; all else about it is wall. A pull
goes up, or slants. It is free if of no body that is still there, and of the wall, the body sweeps over more than the
certificate tolerates (`kernels.sweeps`). That bounds what is shared at any time on the way.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass

import manifold3d
import numpy as np

from ..geometry.containers import Container
from ..geometry.meshes import Body
from .certificate import TOLERANCE

TILTS_DEG = (5, 10, 20, 30, 45, 60)  # of the slanted pulls, after the one that goes up
AZIMUTHS = 8  # of each tilt
LIP = 1e-6  # of the container's height: so far under its top the opening is looked for
MOST_SEEN = 8  # directions along which triangles are kept at a time
ROUNDING = 1e-9  # of the container's longest edge, or of its volume


@dataclass(frozen=True)
class Pull:
    """One body's way out. direction : `(3,)`, a unit vector. length : metres, until it is all above the top. met : the
    largest share, of the smaller one's volume, that it sweeps over of a body that is still there, or of the wall."""

    name: str
    direction: tuple[float, float, float]
    length: float
    met: float


@dataclass(frozen=True)
class Dismantling:
    """How a packing comes apart: pulls in their order. stuck : names of the bodies that no pull frees. left_out : names
    of those that were taken out of the packing, so that it comes apart, and found no other place."""

    pulls: list[Pull]
    stuck: list[str]
    left_out: tuple[str, ...] = ()

    @property
    def holds(self) -> bool:
        """Whether all come out."""
        return not self.stuck

    def summary(self) -> str:
        """What it comes to, in a line."""
        if self.stuck:
            return f"{len(self.stuck)} objects cannot be pulled out through the top: {', '.join(self.stuck)}"
        slanted = sum(pull.direction[2] < 1 for pull in self.pulls)
        ways = "straight up" if not slanted else f"{len(self.pulls) - slanted} straight up, {slanted} at a slant"
        out = f"; left out for that: {', '.join(self.left_out)}" if self.left_out else ""
        return f"comes apart through the top, one by one, {ways}{out}"

    def to_dict(self) -> dict:
        """As plain values, for `result.json`: how the container is loaded, the pulls backwards."""
        loading = [{**asdict(pull), "direction": [-x + 0.0 for x in pull.direction]} for pull in reversed(self.pulls)]
        return {"holds": self.holds, "loading": loading, "stuck": self.stuck, "left_out": list(self.left_out)}


def pull_directions() -> np.ndarray:
    """`(K, 3)` unit vectors, up first, then those that slant more and more."""
    tilts, turns = np.radians(TILTS_DEG), 2 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    slanted = [(np.sin(t) * np.cos(a), np.sin(t) * np.sin(a), np.cos(t)) for t in tilts for a in turns]
    return np.array([(0.0, 0.0, 1.0), *slanted])


class Ways:
    """The ways of bodies, placed by `matrices` `(N, 4, 4)` (file coordinates to the world), along the directions
    `(K, 3)`, which go up. What is found is kept. Fixed bodies are in the way and stay."""

    def __init__(
        self, bodies: Sequence[Body], matrices: np.ndarray, container: Container, directions: np.ndarray | None = None
    ):
        self.bodies, self.container = list(bodies), container
        self.directions = pull_directions() if directions is None else np.asarray(directions, np.float64)
        self.placed = [body.placed(matrix) for body, matrix in zip(bodies, matrices, strict=True)]
        self.volumes = np.array([body.volume for body in bodies])
        self.movable = np.array([not body.wishes.fixed for body in bodies], bool)
        count = len(self.bodies)
        self.met = np.full((len(self.directions), count, count), np.nan)  # shares, infinite above the tolerance
        self.met[:, range(count), range(count)] = 0
        self.walls = np.full((len(self.directions), count), np.nan)
        self._seen: dict[int, _Seen] = {}
        self._shell: tuple[np.ndarray, np.ndarray] | None = None

    def free(self, k: int, i: int, there: np.ndarray) -> bool:
        """Whether body i comes out along direction k past those that are `there` `(N,)` bool."""
        if np.isinf(self.met[k, i, there]).any() or np.isinf(self.wall(k, i)):
            return False
        return all(np.isfinite(self._share(k, i, j)) for j in np.flatnonzero(there & np.isnan(self.met[k, i])))

    def blocked(self, k: int, i: int, by: Iterable[int]) -> np.ndarray:
        """Which of the bodies `by` are in the way of body i along direction k."""
        return np.array([np.isinf(self._share(k, i, j)) for j in by], bool)

    def pull(self, k: int, i: int, there: np.ndarray) -> Pull:
        """Body i's way out, if it is free."""
        met = max(float(self.met[k, i, there].max(initial=0.0)), float(self.wall(k, i)))
        direction = self.directions[k]
        rise = float(self.container.bounds[1, 2] - self.placed[i][:, 2].min())
        return Pull(self.bodies[i].name, tuple(direction.tolist()), max(0.0, rise / float(direction[2])), met)

    def wall(self, k: int, i: int) -> float:
        """The share of body i's volume that it sweeps over of the wall; infinite above what is tolerated."""
        if np.isnan(self.walls[k, i]):
            low, high = self.container.bounds
            # what is a box is convex, so that corners tell: where they reach its top they are still within its sides
            is_box = self.container.volume > (1 - ROUNDING) * np.prod(high - low)
            self.walls[k, i] = self._out_of_box(k, i) if is_box else self._through_shell(k, i)
        return float(self.walls[k, i])

    def _out_of_box(self, k: int, i: int) -> float:
        (low, high), points, direction = self.container.bounds, self.placed[i], self.directions[k]

        def beyond(flat: np.ndarray) -> float:
            return float(np.maximum(low[:2] - flat, flat - high[:2]).max())

        ends = points[:, :2] + direction[:2] * ((high[2] - points[:, 2:]).clip(min=0) / direction[2])
        slack = max(0.0, beyond(points[:, :2])) + ROUNDING * float((high - low).max())
        return 0.0 if beyond(ends) <= slack else np.inf

    def _through_shell(self, k: int, i: int) -> float:
        if self._shell is None:
            self._shell = _wall_of(self.container)
        from ..kernels.sweeps import swept

        seen, (corners, faces) = self._in(k), self._shell
        surface = _facing((corners @ seen.frame.T)[faces])
        return swept(seen.lower(i), *surface, TOLERANCE * self.volumes[i]) / self.volumes[i]

    def _share(self, k: int, i: int, j: int) -> float:
        from ..kernels.sweeps import swept

        if np.isnan(self.met[k, i, j]):
            seen, share = self._in(k), 0.0
            if seen.may_meet(i, j):
                least = min(self.volumes[i], self.volumes[j])
                share = swept(seen.lower(i), *seen.surface(j), TOLERANCE * least) / least
            self.met[k, i, j] = max(share, 0.0)
        return float(self.met[k, i, j])

    def _in(self, k: int) -> _Seen:
        if k not in self._seen:
            if len(self._seen) == MOST_SEEN:
                self._seen.pop(next(iter(self._seen)))
            self._seen[k] = _Seen(self.bodies, self.placed, self.directions[k])
        return self._seen[k]


class _Seen:
    """The bodies as they are seen along a direction: triangles and boxes in a frame whose z it is."""

    def __init__(self, bodies: Sequence[Body], placed: Sequence[np.ndarray], direction: np.ndarray):
        side = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
        side /= np.linalg.norm(side)
        self.frame = np.stack([side, np.cross(direction, side), direction])
        self.bodies, self.points = bodies, [points @ self.frame.T for points in placed]
        self.low = np.array([points.min(0) for points in self.points])
        self.high = np.array([points.max(0) for points in self.points])
        self._triangles: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self._lower: dict[int, np.ndarray] = {}

    def may_meet(self, i: int, j: int) -> bool:
        """Whether body i can meet body j on its way at all, by their boxes."""
        across = (self.low[i, :2] < self.high[j, :2]) & (self.low[j, :2] < self.high[i, :2])
        return bool(across.all() and self.low[i, 2] < self.high[j, 2])

    def surface(self, i: int) -> tuple[np.ndarray, np.ndarray]:
        """A body's triangles, as `_facing` has them."""
        if i not in self._triangles:
            self._triangles[i] = _facing(self.points[i][self.bodies[i].solid_faces])
        return self._triangles[i]

    def lower(self, i: int) -> np.ndarray:
        """A body's triangles `(P, 3, 3)` that face down."""
        if i not in self._lower:
            corners, facing = self.surface(i)
            self._lower[i] = corners[facing < 0]
        return self._lower[i]


def _facing(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of triangles `(F, 3, 3)` those that are not seen as lines, in the order of their lowest x, and whether they face
    up (1) or down (-1)."""
    from ..kernels.sweeps import facing_up

    corners = corners[np.argsort(corners[:, :, 0].min(1), kind="stable")]
    facing = facing_up(corners)
    return corners[facing != 0], facing[facing != 0]


def _wall_of(container: Container) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of all that is wall about a container, up to its top."""
    low, high = container.bounds
    about = float((high - low).sum())  # further than any pull goes sideways
    bottom, lid = low - about, high + about
    lid[2] = high[2] - LIP * (high[2] - low[2])
    block = manifold3d.Manifold.cube(lid - bottom).translate(bottom)
    mesh = (block - container.body.manifold.translate(container.body.centre)).to_mesh64()
    return np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, np.int64)


def opening(container: Container) -> float:
    """Square metres of the container's opening: of its section just under its highest plane."""
    low, high = container.bounds[:, 2] - container.body.centre[2]
    return float(container.body.manifold.slice(high - LIP * (high - low)).area())


def take_apart(ways: Ways, left_out: Sequence[str] = ()) -> Dismantling:
    """Pull body after body out, straight up where that is free, while one is free. Which are stuck does not depend on
    the order, as taking one out blocks none."""
    there = np.ones(len(ways.bodies), bool)
    tops = [points[:, 2].max() for points in ways.placed]
    waiting = sorted(np.flatnonzero(ways.movable).tolist(), key=lambda i: -tops[i])
    pulls = []
    while waiting:
        steps = ((k, i) for k in range(len(ways.directions)) for i in waiting)
        found = next((step for step in steps if ways.free(*step, there)), None)
        if found is None:
            break
        pulls.append(ways.pull(*found, there))
        waiting.remove(found[1])
        there[found[1]] = False
    return Dismantling(pulls, [ways.bodies[i].name for i in sorted(waiting)], tuple(left_out))


def follow(
    bodies: Sequence[Body], matrices: np.ndarray, container: Container, pulls: Sequence[tuple[str, Sequence[float]]]
) -> Dismantling:
    """Prove pulls anew, names and directions in their order: `stuck` are the bodies that do not come out by them."""
    directions = np.array([direction for _, direction in pulls], np.float64).reshape(-1, 3)
    ways = Ways(bodies, matrices, container, directions)
    numbers = {body.name: i for i, body in enumerate(bodies)}
    there, proven = np.ones(len(bodies), bool), []
    for k, (name, _) in enumerate(pulls):
        i = numbers.get(name)
        if i is not None and there[i] and ways.free(k, i, there):
            proven.append(ways.pull(k, i, there))
            there[i] = False
    return Dismantling(proven, [bodies[i].name for i in np.flatnonzero(there & ways.movable)])
