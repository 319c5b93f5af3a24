"""The box of a shape that just holds objects as they lie."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch

from ..exact.certificate import placed_solid
from ..geometry.containers import Container, FreeBox
from ..geometry.meshes import Body
from ..geometry.zones import box_of
from ..poses import Poses, file_to_world


def enclosing_box(
    bodies: Sequence[Body], poses: Poses, shape: FreeBox, most: np.ndarray | None = None
) -> tuple[Container, Poses]:
    """The smallest box of the shape about bodies as they lie, and their poses in it, moved with it to the origin.

    most `(3,)` : edges in metres of a box about the origin that is taken, with the poses as they are, if it is smaller:
    objects may stick out of a box by the certificate's tolerance. A shape with zones needs it: its floor stays.
    """
    matrices = file_to_world(bodies, poses.rotation, poses.translation)
    solids = [placed_solid(body, matrix) for body, matrix in zip(bodies, matrices, strict=True)]
    bounds = np.array([solid.bounding_box() for solid in solids]).reshape(-1, 2, 3)
    low, high = bounds[:, 0].min(0), bounds[:, 1].max(0)
    if shape.zones:  # what lies between them cannot be moved from wall to wall
        low, high = -most / 2, np.array([*most[:2] / 2, high[2]])
    edges = shape.lengths(high - low)
    if shape.cube:
        edges[:] = edges.max()
    if most is not None and np.prod(most) < np.prod(edges):
        return box_of(shape, most), poses
    fits = edges >= high - low
    middle = np.where(shape.free | fits, (low + high) / 2, 0.0)
    return box_of(shape, edges), Poses(poses.rotation, poses.translation - torch.from_numpy(middle))
