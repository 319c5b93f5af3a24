"""Kill runs at random moments and run them again: `python tests/kill.py --times 20 [--of pack sweep figures]`.

The second run must end as an undisturbed one does: the same results but for the seconds, and nothing half-written
beside them.
"""

from __future__ import annotations

import argparse
import csv
import json
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import nbformat
import trimesh

RASP = sys.executable, "-m", "rasp_core"
SETTINGS = ("--container", "box:0.2,0.2,0.2", "--iterations", "60", "--resolution", "64", "--device", "cpu")
NOTEBOOK = """
from matplotlib.figure import Figure
from rasp_core.reproduce import figures
figures.save("01_test", Figure(), {"answer": 42, "made": [0] * 10**6}, out)
"""


@dataclass(frozen=True)
class Job:
    """command : what runs in a folder that holds `pool`, into the folder `out`. outcome : of a finished run in `out`,
    without what differs from run to run. torn : whether what a killed run left mixes two runs."""

    command: Callable[[Path, Path], tuple[str, ...]]
    outcome: Callable[[Path], object]
    torn: Callable[[Path, object], bool] = lambda out, wanted: False


def packed(out: Path) -> tuple[dict, bytes, list[str]]:
    """The record, the scene, and the names of the files."""
    record = json.loads((out / "result.json").read_text())
    record.pop("seconds")
    return record, (out / "scene.glb").read_bytes(), names(out)


def torn(out: Path, wanted) -> bool:
    """A record lies beside another run's scene."""
    return (out / "result.json").exists() and packed(out)[:2] != wanted[:2]


def swept(out: Path) -> tuple[list[dict], int]:
    """The table, and the number of files: a killed run may leave a part of one, no more."""
    with (out / "sweep.csv").open() as file:
        rows = [{key: value for key, value in row.items() if key != "seconds"} for row in csv.DictReader(file)]
    return rows, len([name for name in names(out) if not name.endswith(".part")])


def drawn(out: Path) -> tuple[dict, bytes]:
    """A figure's facts and picture."""
    figures = out / "out" / "figures" / "quick"
    facts = json.loads((figures / "01_test.json").read_text())
    facts.pop("seconds")
    return facts, (figures / "01_test.png").read_bytes()


def draw(folder: Path, out: Path) -> tuple[str, ...]:
    """The command that runs a notebook of its own in `out`."""
    (out / "notebooks").mkdir(parents=True, exist_ok=True)
    (out / "paper_figures").mkdir(exist_ok=True)
    parameters = nbformat.v4.new_code_cell('out = "../out/figures/quick"', metadata={"tags": ["parameters"]})
    cells = [parameters, nbformat.v4.new_code_cell(NOTEBOOK)]
    nbformat.write(nbformat.v4.new_notebook(cells=cells), out / "notebooks" / "01_test.ipynb")
    expected = {"quick": {"answer": {"status": "reproduced", "equals": 42}}}
    (out / "paper_figures" / "01_test.expected.json").write_text(json.dumps(expected))
    return (
        sys.executable,
        "-c",
        f"from pathlib import Path; from rasp_core.reproduce import figures as f; f.run(root=Path({str(out)!r}))",
    )


def names(out: Path) -> list[str]:
    return sorted(path.name for path in out.iterdir())


JOBS = {
    "pack": Job(lambda folder, out: (*RASP, "pack", str(folder / "pool"), *SETTINGS, "--out", str(out)), packed, torn),
    "sweep": Job(
        lambda folder, out: (*RASP, "sweep", str(folder / "pool"), *SETTINGS, "--seeds", "4", "--out", str(out)), swept
    ),
    "figures": Job(draw, drawn),
}


def start(job: Job, folder: Path, out: str, wait: float | None = None) -> subprocess.Popen:
    """Start a job into `out`; after `wait` seconds it is killed, without it is waited for."""
    command = job.command(folder, folder / out)
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        process.wait(wait)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    return process


def run(times: int, seed: int = 0, of: str = "pack") -> list[str]:
    """Kill `times` runs into one folder, each at a random moment, and finish the next; what differs, in words."""
    job, chance, wrong = JOBS[of], random.Random(seed), []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "pool").mkdir()
        for k in range(4):
            trimesh.creation.cylinder(0.02 + 0.005 * k, 0.05).export(folder / "pool" / f"can{k}.stl")
        start(job, folder, "first")  # compiles and bakes what is kept on disk
        began = time.monotonic()
        start(job, folder, "undisturbed")
        seconds = time.monotonic() - began
        wanted = job.outcome(folder / "undisturbed")
        for k in range(times):
            moment = chance.uniform(0.0, 1.05 * seconds)
            out = "out" if of == "pack" else f"out{k}"  # a finished sweep would leave nothing to do
            killed = start(job, folder, out, moment).returncode < 0
            if job.torn(folder / out, wanted):
                wrong.append(f"{of} {k}: after {moment:.2f} s a record lies beside another run's scene")
            start(job, folder, out)
            if job.outcome(folder / out) != wanted:
                wrong.append(f"{of} {k}: killed after {moment:.2f} s, the next run ends otherwise")
            print(f"{of} {k}: {'killed' if killed else 'ended'} after {moment:.2f} of {seconds:.2f} s", file=sys.stderr)
    return wrong


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--of", nargs="+", choices=JOBS, default=["pack"])
    options = parser.parse_args()
    found = [line for of in options.of for line in run(options.times, options.seed, of)]
    total = options.times * len(options.of)
    print("\n".join([*found, f"{total - len(found)} of {total} as undisturbed"]))
    sys.exit(1 if found else 0)
