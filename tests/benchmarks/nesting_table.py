"""The open nesting benchmark: heights of the kit beside those that others report, as a leaderboard in Markdown.

python tests/benchmarks/nesting_table.py [--instances merged2 ...] [--arms dense right ...] [--seeds 3] [--seconds 600]

dense turns freely; right is the same search by right angles alone, which is nearest to the others' rule (turns in 4
steps); spectral is a baseline, by right angles, too. All parts must be in, certified. Runs are kept in --out, so that a
table that was interrupted goes on; with --workers 1 each has the machine for itself. The parts are rebuilt from voxels,
see `data_fetch.nesting`: half a per cent proves nothing.
"""

import argparse
import csv
import os
import platform
import tempfile
from pathlib import Path

import numpy as np

from data_fetch.nesting import INSTANCES, nesting_instance
from rasp_core.cli.sweep import sweep
from rasp_core.packing import from_files, methods
from rasp_core.reproduce.pools import as_files

RIGHT = "right"  # dense, by right-angled turns alone
HEAD = "| instance | parts | sparrow-3d, best | mean | before it |"


def heights(instance, arm: str, seeds: int, seconds: float, out: Path, workers: int) -> list[float]:
    """Of each seed, infinite where not all parts are in or it is not certified."""
    base = f"{instance.base[0]},{instance.base[1]}"
    shared = {"objects": as_files(instance.bodies, out / instance.name), "container": f"auto:{base},*", "method": arm}
    if arm == RIGHT:
        table = out / f"{instance.name}.csv"
        with table.open("w", newline="", encoding="utf-8") as file:
            rows = ([f"{instance.name}/{body.name}.stl", "90"] for body in instance.bodies)
            csv.writer(file).writerows([["file", "turns"], *rows])
        shared |= {"objects": [], "parts": str(table), "method": "dense"}
    runs = [{**shared, "seed": seed, "time_limit": seconds} for seed in range(seeds)]
    volume, area = sum(body.volume for body in instance.bodies), np.prod(instance.base)
    found = sweep(from_files.pack, runs, out / "runs", workers, progress=True)
    whole = [row["certified"] and row["objects"] == len(instance.bodies) for row in found]
    return [volume / area / row["density"] if held else np.inf for row, held in zip(found, whole, strict=True)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--instances", nargs="+", default=list(INSTANCES), choices=INSTANCES)
    parser.add_argument("--arms", nargs="+", default=["dense", RIGHT], choices=(*methods.METHODS[1:], RIGHT))
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path(tempfile.gettempdir()) / "rasp_nesting_table")
    options = parser.parse_args()
    machine = f"{options.workers} at once on {os.cpu_count()} cores, {platform.machine()}"
    print(f"{options.seconds:g} s, {options.seeds} seeds, {machine}\n")
    print(HEAD + "".join(f" {arm}: mean, best to worst | over their best |" for arm in options.arms))
    print("|---" * (5 + 2 * len(options.arms)) + "|")
    ratios = {arm: [] for arm in options.arms}
    for name in options.instances:
        instance = nesting_instance(name)
        told = instance.reported
        line = f"| {name} | {len(instance.bodies)} | {told.best} | {told.mean} | {told.before or '-'} |"
        for arm in options.arms:
            found = heights(instance, arm, options.seeds, options.seconds, options.out, options.workers)
            ratios[arm].append(np.mean(found) / told.best)
            line += f" {np.mean(found):.2f}, {min(found):.2f} to {max(found):.2f} | {ratios[arm][-1]:.3f} |"
        print(line, flush=True)
    for arm, values in ratios.items():
        print(f"\n{arm}: {np.mean(values):.3f} of their best in the mean, {max(values):.3f} at worst")


if __name__ == "__main__":
    main()
