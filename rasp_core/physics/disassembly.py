"""Can the objects of a packing be taken out again, one after the other, each by a straight pull?

The container is opened on all sides, so that this is a question to the objects alone; what no pull frees interlocks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..exact.certificate import TOLERANCE, pairs_of_boxes
from ..exact.placing import placed_solid
from ..geometry.meshes import Body
from ..util import o3d
from ..util.errors import InputError

PULLS = 64  # directions, on both ends of half as many lines
RAYS = 192  # along each edge of the square of rays in every direction
THINNEST = 1e-5  # of the radius of all: what lies behind another by less does not, by rays in single precision
GRAZING_RAYS = 2  # rays that may meet a body in the way by chance, at an edge

Surface = tuple[np.ndarray, np.ndarray]  # vertices (V, 3) in the world, faces (F, 3)


@dataclass(frozen=True)
class Removal:
    """What can be taken out.

    order : the bodies' names as they can be taken, and the direction `(3,)` of each pull. stuck : those that cannot.
    pulls : how many directions were tried.
    """

    order: list[tuple[str, list[float]]]
    stuck: list[str]
    pulls: int

    def to_dict(self) -> dict:
        """As plain numbers, for `result.json`."""
        return {"order": [{"name": name, "pull": pull} for name, pull in self.order], "stuck": self.stuck}

    def summary(self) -> str:
        """For people, a line."""
        if not self.stuck:
            return "all objects can be taken out one by one by straight pulls"
        pulls = f"none of {self.pulls} straight pulls takes them out"
        return f"{len(self.stuck)} objects interlock, {pulls}: {', '.join(self.stuck)}"


def remove_all(
    bodies: Sequence[Body], matrices: np.ndarray, pulls: np.ndarray | None = None, rays: int = RAYS
) -> Removal:
    """Take bodies out, one by one, while one of the pulls frees one.

    bodies placed by `matrices` `(N, 4, 4)` (file coordinates to the world). pulls `(D, 3)`, unit vectors; None: the
    axes and directions spread over the sphere. A body is free if parallel rays in the direction of the pull, `rays`
    along each edge of a square over all bodies, meet no other body behind it. Which bodies are stuck does not depend on
    the order, as taking one out blocks none. What two share within the certificate's tolerance is in nobody's way:
    those that seem stuck are looked at again without it. Raises InputError for fewer than 2 rays.
    """
    if rays < 2:
        raise InputError(f"at least 2 rays along an edge are needed, got {rays}")
    pulls = spread_pulls() if pulls is None else np.asarray(pulls, np.float64)
    surfaces = [(body.placed(matrix), body.solid_faces) for body, matrix in zip(bodies, matrices, strict=True)]
    order, stuck = _taken(surfaces, pulls, rays)
    if stuck and (apart := _without_what_they_share([bodies[i] for i in stuck], np.asarray(matrices)[stuck])):
        more, rest = _taken(apart, pulls, rays)
        order, stuck = order + [(stuck[i], k) for i, k in more], [stuck[i] for i in rest]
    taken = [(bodies[i].name, pulls[k].tolist()) for i, k in order]
    return Removal(taken, [bodies[i].name for i in stuck], len(pulls))


def _taken(surfaces: Sequence[Surface], pulls: np.ndarray, rays: int) -> tuple[list[tuple[int, int]], list[int]]:
    """Which bodies can be taken out, each with the number of its pull, in their order; and which cannot."""
    count = len(surfaces)
    blocks = np.zeros((len(pulls), count, count), bool)
    if count > 1:  # one alone is free; no rays, and no open3d to cast them
        scene, points = _scene(surfaces)
        lines: dict[tuple, np.ndarray] = {}
        for k, pull in enumerate(pulls):
            opposite = tuple(np.round(-pull, 9) + 0.0)
            if opposite in lines:
                blocks[k] = lines[opposite].T
            else:
                blocks[k] = lines[tuple(np.round(pull, 9) + 0.0)] = _behind(scene, points, pull, count, rays)
    left, order = np.ones(count, bool), []
    in_the_way = blocks.sum(2)  # of those that are left
    while left.any():
        free = left & (in_the_way == 0)
        if not free.any():
            break
        pull, index = np.argwhere(free)[0]
        order.append((int(index), int(pull)))
        left[index] = False
        in_the_way -= blocks[:, :, index]
    return order, np.flatnonzero(left).tolist()


def _without_what_they_share(bodies: Sequence[Body], matrices: np.ndarray) -> list[Surface]:
    """The placed solids, the first of two without what it shares with the second where that is tolerated; none if
    nothing is shared."""
    solids = [placed_solid(body, matrix) for body, matrix in zip(bodies, matrices, strict=True)]
    bounds = np.array([solid.bounding_box() for solid in solids]).reshape(-1, 2, 3)
    changed = False
    for i, j in pairs_of_boxes(bounds):
        shared = (solids[i] ^ solids[j]).volume()
        if 0 < shared <= TOLERANCE * min(bodies[i].volume, bodies[j].volume):
            solids[i], changed = solids[i] - solids[j], True
    meshes = [solid.to_mesh64() for solid in solids] if changed else []
    return [(np.asarray(m.vert_properties, np.float64)[:, :3], np.asarray(m.tri_verts, np.int64)) for m in meshes]


def spread_pulls(count: int = PULLS) -> np.ndarray:
    """`(count, 3)` unit vectors, each with its opposite: the axes first, up before all, then a Fibonacci lattice."""
    index = np.arange(max(count // 2 - 3, 0)) + 0.5
    z, angle = index / max(len(index), 1), np.pi * (1 + 5**0.5) * index
    lattice = np.column_stack([np.cos(angle) * (1 - z**2) ** 0.5, np.sin(angle) * (1 - z**2) ** 0.5, z])
    return np.concatenate([[line, -line] for line in np.concatenate([np.eye(3)[::-1], lattice])])


def _scene(surfaces: Sequence[Surface]):
    """The bodies for ray casting, moved so that they lie about the origin, and all their vertices `(P, 3)`."""
    points = np.concatenate([vertices for vertices, _ in surfaces])
    middle = (points.min(0) + points.max(0)) / 2
    return o3d.caster((vertices - middle, faces) for vertices, faces in surfaces), points - middle


def _behind(scene, points: np.ndarray, pull: np.ndarray, count: int, rays: int) -> np.ndarray:
    """`(N, N)` bool: on enough rays in the direction of the pull, body j lies behind body i."""
    core = o3d.load().core
    across = np.linalg.svd(pull[None])[2][1:]
    low, high = (points @ across.T).min(0), (points @ across.T).max(0)
    reach = float(np.linalg.norm(points, axis=1).max())
    at = (np.stack(np.indices((rays, rays)), -1).reshape(-1, 2) + 0.5) / rays
    origins = (low + at * (high - low)) @ across - 2 * reach * pull
    bundle = np.hstack([origins, np.broadcast_to(pull, origins.shape)]).astype(np.float32)
    hits = scene.list_intersections(core.Tensor(bundle))
    ray, body, depth = (hits[name].numpy() for name in ("ray_ids", "geometry_ids", "t_hit"))
    met, which = np.unique(ray.astype(np.int64) * count + body, return_inverse=True)
    first, last = np.full(len(met), np.inf), np.full(len(met), -np.inf)
    np.minimum.at(first, which, depth)
    np.maximum.at(last, which, depth)
    seen = np.zeros((count, count), np.int64)
    ray, body = met // count, met % count
    for step in range(1, int(np.unique(ray, return_counts=True)[1].max(initial=1))):
        same = ray[:-step] == ray[step:]  # all pairs on one ray are some steps apart
        i, j = np.flatnonzero(same), np.flatnonzero(same) + step
        np.add.at(seen, (body[i], body[j]), first[i] < last[j] - THINNEST * reach)
        np.add.at(seen, (body[j], body[i]), first[j] < last[i] - THINNEST * reach)
    return seen >= GRAZING_RAYS
