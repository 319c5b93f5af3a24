"""Time what happens once in a run: import, baking, certificate, a whole run; and its peak memory."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import trimesh
from cases import case, pool

from rasp_core import poses
from rasp_core.exact import certificate
from rasp_core.geometry import sdf

RUN = """
import json, sys, time
from pathlib import Path
began = time.perf_counter()
sys.path.insert(0, sys.argv[1])
from cases import case
from rasp_core.exact.certificate import certify
from rasp_core.optimizer import optimize
from rasp_core.problem import Settings
problem, scene, start = case(int(sys.argv[2]))
found = optimize(problem, Settings(iterations=int(sys.argv[3])), start, scene=scene)
certify(problem.bodies, found.matrices, problem.container)
# getrusage would say the parent's peak where that is larger
status = Path("/proc/self/status")
peak = int(status.read_text().split("VmHWM:")[1].split()[0]) / 2**20 if status.exists() else None
print(json.dumps({"seconds": time.perf_counter() - began, "peak_gib": peak}))
"""


def run(objects: int, iterations: int, environment: dict[str, str] | None = None) -> dict:
    """A run in a process of its own (import, reading, set-up, iterations, certificate): seconds and peak memory."""
    command = [sys.executable, "-c", RUN, str(Path(__file__).parent), str(objects), str(iterations)]
    done = subprocess.run(
        command, capture_output=True, text=True, check=True, env={**os.environ, **(environment or {})}
    )
    return json.loads(done.stdout)


@pytest.mark.benchmark(group="whole runs, each in a new process")
@pytest.mark.parametrize("cache", ["cold", "warm"])
def test_a_thousand_iterations(benchmark, tmp_path, cache):
    """106 objects, the paper's size. Cold: grids are baked and loops compiled."""
    environment = {"RASP_CACHE": str(tmp_path / "s"), "NUMBA_CACHE_DIR": str(tmp_path / "n")} if cache == "cold" else {}
    if cache == "warm":
        run(106, 1)
    benchmark.extra_info.update(benchmark.pedantic(run, (106, 1000, environment), rounds=1, iterations=1))


@pytest.mark.benchmark(group="whole runs, each in a new process")
def test_sixteen_hundred_objects(benchmark):
    """100 iterations."""
    benchmark.extra_info.update(benchmark.pedantic(run, (1600, 100), rounds=1, iterations=1))


@pytest.mark.benchmark(group="whole runs, each in a new process")
def test_import(benchmark):
    """`import rasp_core.packing.result`, the interpreter's start included."""
    benchmark.pedantic(
        subprocess.run, ([sys.executable, "-c", "import rasp_core.packing.result"],), rounds=5, warmup_rounds=1
    )


@pytest.mark.benchmark(group="whole runs, each in a new process")
@pytest.mark.parametrize("cache", ["cold", "warm"])
def test_pack_one_part(benchmark, tmp_path, cache):
    """`rasp pack` of one part into a box, from the interpreter's start to its end: hardly any of it is work."""
    trimesh.creation.cylinder(0.025, 0.05).export(tmp_path / "one.stl")
    command = [sys.executable, "-m", "rasp_core", "pack", str(tmp_path / "one.stl"), "--container", "box:0.3,0.3,0.3"]
    command += ["--out", str(tmp_path / "out")]
    environment = {"RASP_CACHE": str(tmp_path / "s"), "NUMBA_CACHE_DIR": str(tmp_path / "n")} if cache == "cold" else {}
    options = {"check": True, "capture_output": True, "env": {**os.environ, **environment}}
    rounds, warmup = (1, 0) if cache == "cold" else (3, 1)
    benchmark.pedantic(subprocess.run, (command,), options, rounds=rounds, warmup_rounds=warmup)


@pytest.mark.benchmark(group="set-up and certificate")
def test_bake_all_grids(benchmark):
    bodies = pool()
    benchmark.pedantic(lambda: [sdf.bake(b.solid_vertices, b.solid_faces) for b in bodies], rounds=1, iterations=1)


@pytest.mark.benchmark(group="set-up and certificate")
def test_scene_from_cached_grids(benchmark):
    benchmark.pedantic(case()[0].scene, rounds=3)


@pytest.mark.benchmark(group="set-up and certificate")
@pytest.mark.parametrize("objects", [106, 400])
def test_certificate(benchmark, objects):
    """All objects at random poses: 666 pairs to test among 106."""
    problem, _, start = case(objects)
    matrices = poses.file_to_world(problem.bodies, start.rotation, start.translation)
    benchmark.pedantic(certificate.certify, (problem.bodies, matrices, problem.container), rounds=3)
