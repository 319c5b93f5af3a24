"""Density of the paper's whole search with silhouettes, with other shadows and without any, over pools and seeds.

python tests/benchmarks/shadow_table.py [--pools embedded Kitchen ...] [--seeds 3] [--arms ...] [--time-limit S]

embedded : objects that the kit makes, in 0.2 x 0.2 x 0.2 m, 120 iterations. The others: IR-BPP pools by registry in
0.32 x 0.32 x 0.30 m, 1000 iterations. Runs are kept in --out, so that a table that was interrupted goes on; --csv FILE
writes a row for each. shadow_table.csv beside this file has those of the real pools.
"""

import argparse
import csv
import tempfile
from pathlib import Path

import numpy as np
import pools

import data_fetch
from rasp_core.cli.sweep import sweep
from rasp_core.packing import from_files
from rasp_core.reproduce.pools import as_files

ARMS = {
    "silhouettes": {},
    "thickness": {"shadow": "thickness", "silhouette_weight": 10.0},
    "slices": {"shadow": "slices"},
    "none": {"weighting": "no_shadows", "epsilon": 0.001},
}
POOLS = {"embedded": lambda: data_fetch.kitchen_like(48), **pools.POOLS}
COLUMNS = ("pool", "arm", "seed", "objects", "density", "certified", "iterations", "seconds")
SMALL = {"container": "box:0.2,0.2,0.2", "iterations": 120, "resolution": 64}
LARGE = {"container": "box:0.32,0.32,0.30", "iterations": 1000, "resolution": 128, "query_points": 30_000}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pools", nargs="+", default=["embedded"], choices=POOLS)
    parser.add_argument("--arms", nargs="+", default=["silhouettes", "slices", "none"], choices=ARMS)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--time-limit", type=float, help="seconds of each run")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="a table with a row for each run")
    parser.add_argument("--out", type=Path, default=Path(tempfile.gettempdir()) / "rasp_shadow_table")
    options = parser.parse_args()
    table = []
    for pool in options.pools:
        size = SMALL if pool == "embedded" else LARGE
        shared = {"objects": as_files(POOLS[pool](), options.out / pool), "method": "paper", **size}
        shared |= {} if options.time_limit is None else {"time_limit": options.time_limit}
        runs = [{**shared, **ARMS[arm], "seed": seed} for arm in options.arms for seed in range(options.seeds)]
        found = sweep(from_files.pack, runs, options.out / "runs", options.workers, progress=True)
        for k, arm in enumerate(options.arms):
            rows = found[k * options.seeds : (k + 1) * options.seeds]
            density = [row["density"] for row in rows]
            table += [{"pool": pool, "arm": arm, "seed": seed} | row for seed, row in enumerate(rows)]
            print(
                f"{pool:10s} {arm:12s} density {np.mean(density):.4f} ({min(density):.4f} to {max(density):.4f}), "
                f"{sum(row['certified'] for row in rows)} of {len(rows)} certified"
            )
        if options.csv:
            with options.csv.open("w", newline="") as file:
                writer = csv.DictWriter(file, COLUMNS, extrasaction="ignore", lineterminator="\n")
                writer.writeheader()
                writer.writerows(table)


if __name__ == "__main__":
    main()
