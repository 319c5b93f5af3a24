"""Kill `rasp pack` at random moments and run it again: `python tests/kill.py --times 20`.

The second run must end as an undisturbed one does: the same record but for the seconds, the same scene byte for byte,
and nothing half-written beside them.
"""

from __future__ import annotations

import argparse
import json
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import trimesh

SETTINGS = ("--container", "box:0.2,0.2,0.2", "--iterations", "60", "--resolution", "64", "--device", "cpu")


def pack(folder: Path, out: str, wait: float | None = None) -> subprocess.Popen:
    """Start a packing into `out`; after `wait` seconds it is killed, without it is waited for."""
    command = [sys.executable, "-m", "rasp_core", "pack", str(folder / "pool"), *SETTINGS, "--out", str(folder / out)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        process.wait(wait)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    return process


def outcome(out: Path) -> tuple[dict, bytes, list[str]]:
    """A finished run: its record without what differs from run to run, its scene, and the names of its files."""
    record = json.loads((out / "result.json").read_text())
    record.pop("seconds")
    return record, (out / "scene.glb").read_bytes(), sorted(path.name for path in out.iterdir())


def run(times: int, seed: int = 0) -> list[str]:
    """Kill `times` runs into one folder, each at a random moment, and finish the next; what differs, in words."""
    chance, wrong = random.Random(seed), []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "pool").mkdir()
        for k in range(4):
            trimesh.creation.cylinder(0.02 + 0.005 * k, 0.05).export(folder / "pool" / f"can{k}.stl")
        pack(folder, "undisturbed")  # compiles and bakes what is kept on disk
        began = time.monotonic()
        pack(folder, "undisturbed")
        seconds = time.monotonic() - began
        wanted = outcome(folder / "undisturbed")
        for k in range(times):
            moment = chance.uniform(0.0, 1.05 * seconds)
            killed = pack(folder, "out", moment).returncode < 0
            left = folder / "out" / "result.json"
            if left.exists() and outcome(folder / "out")[:2] != wanted[:2]:
                wrong.append(f"{k}: after {moment:.2f} s a record lies beside another run's scene")
            pack(folder, "out")
            if outcome(folder / "out") != wanted:
                wrong.append(f"{k}: killed after {moment:.2f} s, the next run ends otherwise")
            print(f"{k}: {'killed' if killed else 'ended'} after {moment:.2f} of {seconds:.2f} s", file=sys.stderr)
    return wrong


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    found = run(options.times, options.seed)
    print("\n".join([*found, f"{options.times - len(found)} of {options.times} as undisturbed"]))
    sys.exit(1 if found else 0)
