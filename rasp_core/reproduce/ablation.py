"""What each loss, weighting and start does: one arrangement's facts as plain values, for tables and sweeps."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
import trimesh

from ..exact.certificate import certify
from ..geometry.meshes import Body
from ..geometry.surface_points import surface_points
from ..iteration import PULLS_EVERY, Step
from ..objective import LOSS_NAMES
from ..optimizer import Arrangement, optimize
from ..packing import from_files, initialization
from ..poses import file_to_world, to_world
from ..problem import Problem, Settings
from ..silhouettes import render
from ..util import o3d
from ..util.errors import InputError

SAMPLES = 200  # of each body's surface, for the mean gap


def study(
    objects: Sequence[str],
    container: str,
    count: int | None = None,
    filled: float | None = None,
    start: str = "random",
    unit: float = 1.0,
    course: bool = False,
    azimuths_deg: Sequence[float] | None = None,
    elevations_deg: Sequence[float] | None = None,
    **settings,
) -> dict:
    """Arrange some of a pool's objects by Eq. 1, and judge the result.

    objects, container, azimuths_deg, elevations_deg : as `from_files.load` has them. count : the pool's first so many;
    or filled : in the seed's order, as many as come to this share of the container's volume, at most. start : one of
    `initialization.STARTS`. unit : all lengths, the container's too, are divided by it first. settings : of
    `problem.Settings`.

    Returns the facts of `judge`, the loop's seconds of one processor, and with `course` the facts of `Course`. Raises
    InputError where the pool is too small.
    """
    chosen = Settings(**settings)
    pool, room, _ = from_files.load(objects, container, azimuths_deg=azimuths_deg, elevations_deg=elevations_deg)
    if filled is not None:
        pool = [pool[i] for i in np.random.default_rng(chosen.seed).permutation(len(pool))]
        count = int((np.cumsum([body.volume for body in pool]) <= filled * room.volume).sum())
    if count is None or not 1 <= count <= len(pool):
        raise InputError(f"count must be 1 to {len(pool)}, the size of the pool, got {count}")
    bodies = pool[:count]
    if unit != 1:
        bodies, room = [body.scaled(1 / unit) for body in bodies], room.scaled(1 / unit)
    problem = Problem(bodies, room)
    watched = Course(problem, chosen.resolution) if course else None
    begin = initialization.make(start, bodies, room, chosen.seed)
    began = time.process_time()
    run = optimize(problem, chosen, begin, callback=watched)
    seconds = time.process_time() - began
    return judge(run) | {"cpu_seconds": seconds} | (watched.facts(run) if watched else {})


def judge(arrangement: Arrangement) -> dict:
    """Facts of an arrangement, dimensionless but for the gap in metres.

    overlap, extrusion : volume shared by two objects, and outside of the container, over the objects' volume, by exact
    booleans; fault : their sum. silhouette : Eq. 2 without blur. covered : share of the targets that shadows cover.
    gap : `mean_gap`. stuck_out : share of the objects that leave the container. filled : the objects' volume over the
    container's. pull of NAME : each term's share of the gradient, see `Arrangement.gradient_shares`.
    """
    bodies, container = arrangement.problem.bodies, arrangement.problem.container
    certificate = certify(bodies, arrangement.matrices, container)
    volume = sum(body.volume for body in bodies)
    return {
        "overlap": certificate.overlap_volume / volume,
        "extrusion": certificate.protrusion_volume / volume,
        "fault": certificate.fault_volume / volume,
        "stuck_out": len(certificate.protrusions) / len(bodies),
        "silhouette": float(np.square(arrangement.images - arrangement.targets).mean()),
        "covered": float((arrangement.images * arrangement.targets).sum() / arrangement.targets.sum()),
        "gap": mean_gap(bodies, arrangement.matrices),
        "filled": volume / container.volume,
        **{f"pull of {name}": share for name, share in arrangement.gradient_shares.items()},
    }


class Course:
    """A callback that looks at a run every ten iterations; columns of `FACTS`."""

    FACTS = ("silhouette", "overlap", "extrusion", "farthest")

    def __init__(self, problem: Problem, resolution: int):
        self.problem, self.resolution, self.rows = problem, resolution, []
        scene = problem.scene()
        self.outlines, self.views, self.targets = scene.outlines, scene.views, scene.container_silhouettes(resolution)
        self.vertices, self.vertex_body = scene.outlines.vertices, scene.outlines.vertex_body
        self.volume = sum(body.volume for body in problem.bodies)

    def __call__(self, step: Step) -> None:
        if step.iteration % PULLS_EVERY:
            return
        rotation, translation = step.rotation.float(), step.translation.float()
        images = render(self.outlines, rotation, translation, self.views, self.resolution)
        certificate = certify(
            self.problem.bodies, file_to_world(self.problem.bodies, rotation, translation), self.problem.container
        )
        points = to_world(rotation, translation, self.vertex_body, self.vertices)
        self.rows.append(
            (
                (images - self.targets).square().mean().item(),
                certificate.overlap_volume / self.volume,
                certificate.protrusion_volume / self.volume,
                self.problem.container.signed_distance(points)[0].max().item(),
            )
        )

    def facts(self, arrangement: Arrangement) -> dict:
        """Lists over the iterations, every tenth: Eq. 2 without blur in views close about the container, shared and
        outside volume over the objects', a vertex's largest S_C in metres, and each term's share of the gradient."""
        columns = np.array(self.rows).T.tolist()
        shares = (arrangement.pulls / arrangement.pulls.sum(1, keepdims=True)).T.tolist()
        return {
            **{f"course of {name}": values for name, values in zip(self.FACTS, columns, strict=True)},
            **{f"course of pull of {name}": values for name, values in zip(LOSS_NAMES[1:], shares, strict=True)},
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
