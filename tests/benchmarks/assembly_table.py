"""Part accuracy and seconds on the embedded fractures.

python tests/benchmarks/assembly_table.py --parts 2 --seeds 5 [--objects 10]
"""

import argparse
import time

import numpy as np
import trimesh

from data_fetch import fracture, vessels
from rasp_core.accuracy import measure
from rasp_core.assembly import assemble
from rasp_core.containers import Container
from rasp_core.meshes import make_body


def scattered(parts, random):
    """The parts turned and moved at random, and the motions that bring them back."""
    found, back = [], []
    for part in parts:
        motion = trimesh.transformations.random_rotation_matrix(random.random(3))
        motion[:3, 3] = random.normal(size=3)
        found.append(make_body(part.name, trimesh.transform_points(part.placed(np.eye(4)), motion), part.solid_faces))
        back.append(np.linalg.inv(motion))
    return found, np.stack(back)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--parts", type=int, default=2)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--objects", type=int, default=10)
    options = parser.parse_args()
    right, degrees, seconds = [], [], []
    for vessel in vessels()[: options.objects]:
        for seed in range(options.seeds):
            bodies, truth = scattered(fracture(vessel, options.parts, seed), np.random.default_rng(seed))
            began = time.monotonic()
            found = assemble(bodies, Container(vessel), seed)
            seconds.append(time.monotonic() - began)
            errors = measure(bodies, found.matrices, truth)
            right.append(errors.parts)
            degrees += list(errors.rotation[1:])
            print(f"{vessel.name} seed {seed}: {errors.parts:.2f} of the parts, {seconds[-1]:.1f} s", flush=True)
    whole = sum(r == 1 for r in right)
    print(
        f"{options.parts} parts: accuracy {np.mean(right):.3f} in the mean, all right in {whole} of {len(right)}; "
        f"median rotation error {np.median(degrees):.2f} degrees; {np.mean(seconds):.1f} s in the mean, "
        f"{max(seconds):.1f} at most"
    )


if __name__ == "__main__":
    main()
