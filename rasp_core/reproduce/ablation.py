"""What each loss and each start does: one arrangement's facts as plain values, for tables and sweeps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh

from ..exact.certificate import certify
from ..geometry.meshes import Body
from ..geometry.surface_points import surface_points
from ..optimizer import Arrangement, optimize
from ..packing import initialization, methods
from ..problem import Problem, Settings
from ..util import o3d
from ..util.errors import InputError

SAMPLES = 200  # of each body's surface, for the mean gap


def study(objects: Sequence[str], container: str, count: int, start: str = "random", **settings) -> dict:
    """Arrange `count` objects by Eq. 1, the pool's first, and judge the result.

    objects, container : as `jobs.load` has them. start : one of `starts.STARTS`. settings : of `problem.Settings`.
    Returns the facts of `judge`. Raises InputError where the pool is too small.
    """
    chosen = Settings(**settings)
    pool, room, _ = methods.load(objects, container)
    if not 1 <= count <= len(pool):
        raise InputError(f"count must be 1 to {len(pool)}, the size of the pool, got {count}")
    bodies = pool[:count]
    return judge(optimize(Problem(bodies, room), chosen, initialization.make(start, bodies, room, chosen.seed)))


def judge(arrangement: Arrangement) -> dict:
    """Facts of an arrangement, dimensionless but for the gap in metres.

    overlap, extrusion : volume shared by two objects, and outside of the container, over the objects' volume, by exact
    booleans. silhouette : Eq. 2 without blur. gap : `mean_gap`. stuck_out : share of the objects that leave the
    container.
    """
    bodies, container = arrangement.problem.bodies, arrangement.problem.container
    certificate = certify(bodies, arrangement.matrices, container)
    volume = sum(body.volume for body in bodies)
    return {
        "overlap": certificate.overlap_volume / volume,
        "extrusion": certificate.protrusion_volume / volume,
        "stuck_out": len(certificate.protrusions) / len(bodies),
        "silhouette": float(np.square(arrangement.images - arrangement.targets).mean()),
        "gap": mean_gap(bodies, arrangement.matrices),
    }


def mean_gap(bodies: Sequence[Body], matrices: np.ndarray, samples: int = SAMPLES) -> float:
    """Metres from a point of a body's surface to the nearest other body, in the mean over bodies and points; a point
    inside another counts 0. bodies placed by `matrices` `(N, 4, 4)`; infinite for one body alone."""
    known = {}
    for body in bodies:
        if body.digest not in known:
            scene = o3d.caster([(body.solid_vertices, body.solid_faces)])
            known[body.digest] = scene, surface_points(body.solid_vertices, body.solid_faces, samples)[0]
    total = 0.0
    for i, body in enumerate(bodies):
        own = matrices[i].copy()
        own[:3, 3] += own[:3, :3] @ body.centre
        points = trimesh.transform_points(known[body.digest][1], own)
        least = np.full(len(points), np.inf)
        for j, other in enumerate(bodies):
            if i != j:
                local = trimesh.transform_points(points, np.linalg.inv(matrices[j])) - other.centre
                distance = known[other.digest][0].compute_signed_distance(local.astype(np.float32)).numpy()
                least = np.minimum(least, distance)
        total += float(np.maximum(least, 0).mean())
    return total / len(bodies)
