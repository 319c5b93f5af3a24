"""Objects in their bounding shapes, and what those share where the objects share nothing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..exact.certificate import placed_solid
from ..geometry.meshes import Body, make_body
from .scene3d import colours, scene_picture, trimmed
from .style import OVERLAP

GLASS = (0.55, 0.62, 0.70, 0.2)
RED = (*OVERLAP, 0.6)


def shared(bodies: Sequence[Body], matrices: np.ndarray) -> list[Body]:
    """What each two of bodies that `matrices` `(N, 4, 4)` place have in common, as bodies where they lie."""
    solids = [placed_solid(body, matrix) for body, matrix in zip(bodies, matrices, strict=True)]
    found = []
    for i, solid in enumerate(solids):
        for other in solids[:i]:
            common = solid ^ other
            if common.volume() > 1e-4 * bodies[i].volume:
                mesh = common.to_mesh64()
                found.append(make_body("shared", np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts)))
    return found


def enclosed(bodies: Sequence[Body], proxies: Sequence[Body], matrices: np.ndarray, size=(640, 520)) -> np.ndarray:
    """A picture of bodies in their proxies, all placed by `matrices` `(N, 4, 4)`; what proxies share is red."""
    common = shared(proxies, matrices)
    hues = [*((*hue, 1.0) for hue in colours(len(bodies))), *[GLASS] * len(proxies), *[RED] * len(common)]
    places = np.concatenate([matrices, matrices, np.tile(np.eye(4), (len(common), 1, 1))])
    look = {"azimuth_deg": 0.0, "elevation_deg": 12.0, "hues": np.array(hues)}
    return trimmed(scene_picture([*bodies, *proxies, *common], places, size=size, **look), 4)


def overlapping(bodies: Sequence[Body], matrices: np.ndarray, size=(700, 520)) -> np.ndarray:
    """A picture of bodies that `matrices` `(N, 4, 4)` place, as glass, with what two of them share in red."""
    common = shared(bodies, matrices)
    hues = np.array([*[(*GLASS[:3], 0.3)] * len(bodies), *[(*OVERLAP, 1.0)] * len(common)])
    places = np.concatenate([matrices, np.tile(np.eye(4), (len(common), 1, 1))])
    look = {"azimuth_deg": 0.0, "elevation_deg": 6.0, "hues": hues}
    return trimmed(scene_picture([*bodies, *common], places, size=size, **look), 4)
