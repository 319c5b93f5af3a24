"""open3d, imported where it is used and without what it says and starts in notebooks."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from types import ModuleType

import numpy as np


def load() -> ModuleType:
    """The module open3d, its web visualiser left off, and no channel opened to a notebook's page."""
    os.environ["OPEN3D_DISABLE_WEB_VISUALIZER"] = "true"
    if "open3d" not in sys.modules:
        import comm

        # open3d imports dash for a plot that is not used here; in a notebook dash opens a channel that no page answers
        opened, comm.create_comm = comm.create_comm, comm.DummyComm
        try:
            import open3d
        finally:
            comm.create_comm = opened
    import open3d

    return open3d


def caster(surfaces: Iterable[tuple[np.ndarray, np.ndarray]]):
    """A RaycastingScene of closed surfaces, vertices `(V, 3)` and faces `(F, 3)` each, numbered in their order."""
    open3d = load()
    scene = open3d.t.geometry.RaycastingScene()
    for vertices, faces in surfaces:
        corners = np.ascontiguousarray(vertices, np.float32)
        scene.add_triangles(open3d.core.Tensor(corners), open3d.core.Tensor(np.ascontiguousarray(faces, np.uint32)))
    return scene
