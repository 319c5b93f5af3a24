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


def depths(scene, points: np.ndarray, inwards: np.ndarray, skin: float) -> np.ndarray:
    """`(M,)` metres to the other side of a scene's surface, infinite where there is none: from a skin's thickness
    behind points `(M, 3)` of it along unit vectors `(M, 3)`."""
    rays = np.concatenate([points + skin * inwards, inwards], 1).astype(np.float32)
    return scene.cast_rays(load().core.Tensor(rays))["t_hit"].numpy().astype(np.float64)
