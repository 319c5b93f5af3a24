"""What the benchmarks share: the pool repeated in a box that keeps the density, and what JSON says of the machine."""

import os
from functools import cache
from pathlib import Path

import torch

from data_fetch import kitchen_like
from rasp_core.api import run_folder
from rasp_core.geometry import containers
from rasp_core.geometry.cameras import spread_views
from rasp_core.geometry.meshes import load_bodies, unique_names
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


def pytest_benchmark_update_machine_info(config, machine_info):
    """Versions and devices; not the machine's name."""
    machine_info.pop("node", None)
    gpu = torch.cuda.get_device_name() if torch.cuda.is_available() else None
    pool_name = "kitchen" if pool()[0].name != kitchen_like(1)[0].name else "kitchen_like"
    machine_info.update(versions=run_folder.versions(), threads=torch.get_num_threads(), gpu=gpu, pool=pool_name)


def pytest_benchmark_update_json(config, benchmarks, output_json):
    """Leave out single measurements and processor flags, so that the file can be kept in the repository."""
    output_json["machine_info"]["cpu"].pop("flags", None)
    output_json["machine_info"].pop("release", None)
    for benchmark in output_json["benchmarks"]:
        benchmark["stats"].pop("data", None)
