"""Part accuracy and seconds on the embedded fractures.

python tests/benchmarks/assembly_table.py --parts 2 --seeds 5 [--objects 10] [--silhouettes]
"""

import argparse
import time

import numpy as np

from data_fetch import fracture, scatter, vessels
from rasp_core.assembly.assemble import assemble, assemble_by_silhouettes
from rasp_core.assembly.metrics import measure
from rasp_core.geometry.cameras import box_views
from rasp_core.geometry.containers import Container
from rasp_core.geometry.silhouette_edges import Views
from rasp_core.silhouettes import render_at_rest


def shadows(vessel):
    """Three silhouettes of 256 x 256 pixels, and their cameras."""
    cameras = box_views(2.2 * float(np.linalg.norm(vessel.half_extents)), vessel.centre)
    return render_at_rest(vessel, Views(cameras), 256).numpy(), cameras


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--parts", type=int, default=2)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--objects", type=int, default=10)
    parser.add_argument("--silhouettes", action="store_true", help="three silhouettes instead of the whole's mesh")
    options = parser.parse_args()
    right, degrees, seconds = [], [], []
    for vessel in vessels()[: options.objects]:
        for seed in range(options.seeds):
            bodies, truth = scatter(fracture(vessel, options.parts, seed), seed)
            began = time.monotonic()
            if options.silhouettes:
                found = assemble_by_silhouettes(bodies, *shadows(vessel), seed)
            else:
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
