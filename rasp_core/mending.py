"""Exact booleans push apart what still overlaps by a hair, where signed distance grids see nothing any more.

Where bodies A and B share a volume V, a move of A changes V by the area vectors of that part of A's surface that bounds
it: dV = S . shift + T . turn, with S the sum of the area vectors and T that of their moments about A's centre. A step
of Newton's method down that gradient halves a thin V at least.
"""

from __future__ import annotations

from collections.abc import Sequence

import manifold3d
import numpy as np
import torch

from .arrange import file_to_world
from .certify import TOLERANCE, pairs_of_boxes, placed_solid
from .containers import Container
from .meshes import Body
from .poses import angles_to_rotation
from .problem import Start

SWEEPS = 25
BETTER = 0.8  # the worst fault must fall below this share of what it was some sweeps ago
PATIENCE = 6  # sweeps


def mend(bodies: Sequence[Body], start: Start, container: Container, tolerance: float = TOLERANCE) -> Start | None:
    """Move bodies that overlap or stick out a little, until none does by more than `tolerance` of its volume.

    Returns the poses for which exact booleans find that, or None where the faults do not get smaller. For faults of
    some thousandths of a volume; each of at most SWEEPS sweeps takes the time of a certificate.
    """
    rotation, translation = start.rotation.double().clone(), start.translation.double().clone()
    reach = np.array([body.radius for body in bodies])
    hull = container.body.manifold.translate(container.body.centre)
    worst_of = []
    for _ in range(SWEEPS):
        poses = Start(rotation, translation)
        faults = _faults(bodies, poses, container, hull)
        worst_of.append(max((share for *_, share in faults), default=0.0))
        if worst_of[-1] <= tolerance:
            return poses
        if len(worst_of) > PATIENCE and worst_of[-1] > BETTER * worst_of[-1 - PATIENCE]:
            return None
        shift, turn, count = np.zeros((len(bodies), 3)), np.zeros((len(bodies), 3)), np.zeros(len(bodies))
        centres = translation.numpy()
        for movers, common, volume, share in faults:
            if share < tolerance / 2:
                continue
            slopes = [(i, *_slope(common, solid, centres[i])) for i, solid in movers]
            steep = sum(force @ force + moment @ moment / reach[i] ** 2 for i, force, moment in slopes)
            if steep > 0:
                for i, force, moment in slopes:
                    shift[i] -= volume / steep * force
                    turn[i] -= volume / steep * moment / reach[i] ** 2
                    count[i] += 1
        translation += torch.from_numpy(shift)
        rotation = angles_to_rotation(torch.from_numpy(turn)) @ rotation
    return None


def _faults(bodies: Sequence[Body], start: Start, container: Container, hull: manifold3d.Manifold) -> list[tuple]:
    """Each fault: the bodies that can mend it, with their solids; the solid at fault; its volume; its share of the
    smaller body's."""
    matrices = file_to_world(bodies, start.rotation, start.translation)
    solids = [placed_solid(body, matrix).as_original() for body, matrix in zip(bodies, matrices, strict=True)]
    boxes = np.array([solid.bounding_box() for solid in solids]).reshape(-1, 2, 3)
    found = []
    for i, j in pairs_of_boxes(boxes):
        common = solids[i] ^ solids[j]
        volume = common.volume()
        if volume > 0:
            share = volume / min(bodies[i].volume, bodies[j].volume)
            found.append(([(i, solids[i]), (j, solids[j])], common, volume, share))
    for i, solid in enumerate(solids):
        if container.size is not None and (np.abs(boxes[i]) <= container.size / 2).all():
            continue
        out = solid - hull
        volume = out.volume()
        if volume > 0:
            found.append(([(i, solid)], out, volume, volume / bodies[i].volume))
    return found


def _slope(
    common: manifold3d.Manifold, solid: manifold3d.Manifold, centre: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """How the volume of `common` grows with shifts `(3,)` of a solid that bounds it, and with turns about `centre`."""
    mesh = common.to_mesh64()
    corners = np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts)]
    runs = np.diff(np.asarray(mesh.run_index)) // 3
    own = np.repeat(np.asarray(mesh.run_original_id), runs) == solid.original_id()
    a, b, c = corners[own].transpose(1, 0, 2)
    areas = np.cross(b - a, c - a) / 2
    return areas.sum(0), np.cross((a + b + c) / 3 - centre, areas).sum(0)
