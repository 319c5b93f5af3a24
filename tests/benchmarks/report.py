"""What a benchmark's JSON says of growth with the number of objects, and of the distance to the machine's limits.

    python tests/benchmarks/report.py bench.json

The roofline: the bytes and operations of one iteration at the paper's size that no implementation avoids, over the
memory bandwidth and the arithmetic rate measured here, with all of torch's threads.
"""

import json
import sys
import time

import numpy as np
import torch
from cases import case

from rasp_core import optimizer, query_points, silhouettes
from rasp_core.problem import Settings


def slope(times: dict[int, float]) -> float:
    """Exponent of growth: of a straight line through the logarithms."""
    return float(np.polyfit(np.log(list(times)), np.log(list(times.values())), 1)[0])


def best(action, repeats: int = 7) -> float:
    """Seconds of the quickest of some repetitions."""
    seconds = []
    for _ in range(repeats):
        began = time.perf_counter()
        action()
        seconds.append(time.perf_counter() - began)
    return min(seconds)


def machine() -> tuple[float, float]:
    """Bytes per second of a copy of 256 MB (read and written), operations per second of a float32 matrix product."""
    source = torch.ones(64 * 2**20)
    target = torch.empty_like(source)
    square = torch.ones(1500, 1500)
    return 2 * 4 * len(source) / best(lambda: target.copy_(source)), 2 * 1500**3 / best(lambda: square @ square)


def unavoidable() -> dict[str, tuple[float, float, float]]:
    """Part -> how many, bytes, operations of one iteration at the paper's size, after ten iterations from the start."""
    problem, scene, start = case()
    found = optimizer.optimize(problem, Settings(iterations=10), start, scene=scene)
    rotation, translation = found.rotation.float(), found.translation.float()
    points = query_points.query_lattice(scene.container).points()
    boxed = inside = 0
    for body in range(len(problem.bodies)):
        local = (points - translation[body]) @ rotation[body]
        local = local[(local.abs() < scene.half[body]).all(1)]
        boxed += len(local)
        inside += int((scene.stack.sample(torch.full((len(local),), body), local)[0] < 0).sum())
    outlines, views, pixels = scene.outlines, len(scene.cameras), 256 * 256
    contours = silhouettes._Contours(outlines, rotation, translation, scene.views, 256)
    vertices, faces, edges = len(outlines.vertices), len(outlines.normals), len(outlines.edges)
    taps = 2 * (2 * 24 + 1)  # a Gaussian of 8 pixels, along rows and columns
    return {
        # a value of 4 bytes; a turn, a shift and an index
        "object-point pairs in the objects' boxes": (boxed, 4 * boxed, 30 * boxed),
        # the seven other corners; value, slope, force and moment
        "pairs inside": (inside, 28 * inside, 70 * inside),
        "query points, tally": (len(points), 4 * len(points), len(points)),
        "vertices, read once, written for each view": (vertices, (12 + 8 * views) * vertices, 18 * views * vertices),
        "faces, each view": (views * faces, 16 * faces, 6 * views * faces),
        "edges, two flags for each view": (views * edges, 16 * edges, 2 * views * edges),
        "cuts of contours with pixel rows": (len(contours.cut), 16 * len(contours.cut), 30 * len(contours.cut)),
        # image, target, difference, gradient; two blurs
        "pixels": (views * pixels, 16 * views * pixels, 4 * taps * views * pixels),
        "vertices near the wall": (vertices, 12 * vertices, 25 * vertices),
    }


def main(path: str) -> None:
    """Print the report of one file."""
    with open(path) as file:
        found = json.load(file)
    per = {b["name"]: b["stats"]["median"] / 20 for b in found["benchmarks"] if "ms_per_iteration" in b["extra_info"]}
    for title, name in [
        ("80,000 points", "test_objects[{}-80000]"),
        ("512,000 points", "test_objects[{}-512000]"),
        ("points in proportion", "test_objects_and_points[{}]"),
    ]:
        times = {count: per[name.format(count)] for count in (106, 400, 1600)}
        words = ", ".join(f"{1000 * seconds:.1f} ms" for seconds in times.values())
        print(f"106, 400, 1600 objects, {title}: {words}; exponent {slope(times):.2f}")
    bandwidth, rate = machine()
    print(f"\nmeasured here: {bandwidth / 1e9:.1f} GB/s, {rate / 1e9:.0f} GFLOP/s, {torch.get_num_threads()} threads")
    parts = unavoidable()
    print(f"{'one iteration at the least':<45} {'count':>9} {'MB':>7} {'Mop':>7} {'ms, bytes':>10} {'ms, ops':>8}")
    parts["together"] = (0, *(sum(part[i] for part in parts.values()) for i in (1, 2)))
    for part, (count, moved, operations) in parts.items():
        print(
            f"{part:<45} {count or '':>9} {moved / 1e6:7.2f} {operations / 1e6:7.1f} "
            f"{1000 * moved / bandwidth:10.2f} {1000 * operations / rate:8.2f}"
        )
    print(f"{'measured':<45} {'':>9} {'':>7} {'':>7} {1000 * per['test_objects[106-80000]']:10.2f}")


if __name__ == "__main__":
    main(sys.argv[1])
