"""Milliseconds of an iteration on a GPU, as recorded and played, and one by one; never part of the tests.

python tests/benchmarks/gpu_table.py [--objects 106 1600] [--pixels 512] [--points 80000] [--iterations 1000]

The pool is the real Kitchen set where it is at hand. Poses of two runs are compared bit by bit.
"""

import argparse
import time

import torch
from cases import case, pool

from rasp_core import iteration, optimizer
from rasp_core.objective import LOSS_NAMES
from rasp_core.problem import Settings


def seconds(action):
    """What it returns, and the seconds until the GPU was done with it."""
    torch.cuda.synchronize()
    began = time.perf_counter()
    result = action()
    torch.cuda.synchronize()
    return result, time.perf_counter() - began


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--objects", type=int, nargs="+", default=[106, 1600])
    parser.add_argument("--pixels", type=int, default=512)
    parser.add_argument("--points", type=int, default=80_000)
    parser.add_argument("--iterations", type=int, default=1000)
    options = parser.parse_args()
    print(f"{torch.cuda.get_device_name()}, torch {torch.__version__}, objects like {pool()[0].name}")
    for objects in options.objects:
        problem, _, start = case(objects)
        settings = Settings(iterations=options.iterations, resolution=options.pixels, query_points=options.points)
        scene = problem.scene("cuda", viewing_volume=settings.viewing_volume)

        def run(problem=problem, settings=settings, start=start, scene=scene):
            return optimizer.optimize(problem, settings, start, scene=scene)

        first, whole = seconds(run)
        again, warm = seconds(run)
        same = torch.equal(first.rotation, again.rotation) and torch.equal(first.translation, again.translation)
        state = iteration.init(problem, settings, start, scene)
        optimizer.run(state, lambda step: step.iteration == 100)
        _, played = seconds(lambda state=state: iteration.played(state, range(101, 201)))
        _, by_one = seconds(lambda state=state: [iteration.step(state) for _ in range(20)])
        print(
            f"{objects} objects, {options.points} points, 3 x {options.pixels}^2: {10 * played:.2f} ms an iteration, "
            f"played; {50 * by_one:.1f} ms, one by one; {options.iterations} iterations in {whole:.1f} s, again in "
            f"{warm:.1f} s, poses {'the same' if same else 'not the same'} bit for bit; losses at the end "
            + ", ".join(f"{name} {x:.3g}" for name, x in zip(LOSS_NAMES, first.history[-1], strict=True)),
            flush=True,
        )


if __name__ == "__main__":
    main()
