"""What the benchmarks share: the pool, repeated in a box that keeps the density."""

import os
from functools import cache
from pathlib import Path

from data_fetch import kitchen_like
from rasp_core.geometry import containers
from rasp_core.geometry.cameras import spread_views
from rasp_core.geometry.loading import load_bodies
from rasp_core.geometry.meshes import unique_names
from rasp_core.poses import Poses
from rasp_core.problem import Problem

PAPER = 106  # Kitchen objects, in IR-BPP's container
EDGES = (0.32, 0.32, 0.30)


@cache
def pool():
    """The Kitchen objects, or the embedded set where the real ones are not at hand."""
    folder = Path(os.environ.get("RASP_DATA_MIRROR") or Path(__file__).resolve().parents[3] / "shared/data") / "kitchen"
    return load_bodies([folder]) if folder.is_dir() else kitchen_like(PAPER)


@cache
def case(objects: int = PAPER, views: int = 3):
    """Problem, scene and random poses."""
    bodies = unique_names([pool()[i % PAPER] for i in range(objects)])
    growth = (objects / PAPER) ** (1 / 3)
    box = containers.box([growth * edge for edge in EDGES])
    cameras = None if views == 3 else spread_views(views, 1.1 * 3**0.5 * float(box.size.max()), (0, 0, 0))
    problem = Problem(bodies, box, cameras)
    return problem, problem.scene(), Poses.random(bodies, box, 0)
