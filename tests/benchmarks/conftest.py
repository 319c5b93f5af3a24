"""What the benchmarks' JSON says of the machine."""

import torch
from cases import pool

from data_fetch import kitchen_like
from rasp_core.api import run_folder


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
