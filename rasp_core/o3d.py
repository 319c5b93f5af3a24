"""open3d, imported where it is used and without what it says and starts in notebooks."""

from __future__ import annotations

import os
from types import ModuleType


def load() -> ModuleType:
    """The module open3d, its web visualiser left off."""
    os.environ["OPEN3D_DISABLE_WEB_VISUALIZER"] = "true"
    import open3d

    return open3d
