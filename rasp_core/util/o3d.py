"""open3d, imported where it is used and without what it says and starts in notebooks, or loads for web pages."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from types import ModuleType

import numpy as np


def load() -> ModuleType:
    """The module open3d, its web visualiser left off, and `open3d.visualization.draw_plotly` without its web server."""
    os.environ["OPEN3D_DISABLE_WEB_VISUALIZER"] = "true"
    if "dash" in sys.modules or "open3d" in sys.modules:
        import open3d
    else:
        # open3d imports dash (flask, pydantic, IPython: 600 modules, most of its time) for that one function
        sys.modules["dash"] = _Nothing("dash")
        try:
            import open3d
        finally:
            sys.modules.pop("dash", None)
    return open3d


class _Nothing(ModuleType):
    """A module of which everything can be imported, and is None."""

    def __getattr__(self, name: str) -> None:
        return None


def caster(surfaces: Iterable[tuple[np.ndarray, np.ndarray]]):
    """A RaycastingScene of closed surfaces, vertices `(V, 3)` and faces `(F, 3)` each, numbered in their order."""
    open3d = load()
    scene = open3d.t.geometry.RaycastingScene()
    for vertices, faces in surfaces:
        corners = np.ascontiguousarray(vertices, np.float32)
        scene.add_triangles(open3d.core.Tensor(corners), open3d.core.Tensor(np.ascontiguousarray(faces, np.uint32)))
    return scene
