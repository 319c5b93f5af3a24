"""The paper's loop alone, with shadows and without: volume at fault after 1000 iterations, over weights, seeds, pools.

python tests/benchmarks/loop_table.py [--pools Kitchen BlockOut General] [--seeds 3] [--workers 2]

Objects that come to half of the box, from random poses. Each arm is shown at all its weights, so that it can be seen
whether the best lies within them. Runs are kept in --out, so that a table that was interrupted goes on.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from pools import POOLS

from rasp_core.cli.sweep import sweep
from rasp_core.reproduce import ablation
from rasp_core.reproduce.pools import as_files

SHADOWS = [
    {"silhouette_weight": weight, "lambda_": lambda_, "epsilon": epsilon}
    for weight in (0.1, 0.3, 1.0, 3.0)
    for lambda_, epsilon in ((0.001, 0.01), (0.3, 0.0003))
]
NONE = [{"weighting": "no_shadows", "lambda_": lambda_, "epsilon": 0.0001} for lambda_ in (0.0001, 0.0003, 0.001, 0.01)]
RUN = {"container": "box:0.32,0.32,0.30", "filled": 0.5, "resolution": 128, "query_points": 30_000}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pools", nargs="+", default=["Kitchen", "BlockOut", "General"], choices=POOLS)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--iterations", type=int, default=1000)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--out", type=Path, default=Path(tempfile.gettempdir()) / "rasp_loop_table")
    options = parser.parse_args()
    print("| pool | weights | volume at fault, mean | least to most | shadows covered |\n|---|---|---|---|---|")
    for pool in options.pools:
        shared = {"objects": as_files(POOLS[pool](), options.out / pool), "iterations": options.iterations, **RUN}
        runs = [{**shared, **arm, "seed": seed} for arm in SHADOWS + NONE for seed in range(options.seeds)]
        found = sweep(ablation.study, runs, options.out / "runs", options.workers)
        for k, arm in enumerate(SHADOWS + NONE):
            rows = found[k * options.seeds : (k + 1) * options.seeds]
            fault, covered = (np.array([row[name] for row in rows]) for name in ("fault", "covered"))
            words = ", ".join(f"{name.strip('_')} {value}" for name, value in arm.items())
            spread = f"{fault.min():.2%} to {fault.max():.2%}"
            print(f"| {pool} | {words} | {fault.mean():.2%} | {spread} | {covered.mean():.1%} |", flush=True)


if __name__ == "__main__":
    main()
