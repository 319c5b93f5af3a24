"""Part accuracy and seconds on scans of really broken things: pairs that touch, or all parts.

python tests/benchmarks/scan_table.py cake --pairs 5 --seeds 5
python tests/benchmarks/scan_table.py venus --parts 1 2 --seeds 5
python tests/benchmarks/scan_table.py venus [--alone]
"""

import argparse
import time
from itertools import combinations

import numpy as np
from scipy.spatial import cKDTree

from data_fetch import fetch_fracture, joined, reconstruct, scatter
from rasp_core.assembly.assemble import assemble
from rasp_core.assembly.metrics import measure
from rasp_core.assembly.pieces_alone import assemble_alone
from rasp_core.geometry.containers import Container

NEAR = 0.03  # in the scans' unit, a fortieth of the thing: points so near to another part lie on the break


def touching(pieces, count):
    """The `count` pairs whose smaller share of points on the break is largest."""
    trees = [cKDTree(piece.solid_vertices + piece.centre) for piece in pieces]

    def share(pair):
        near = [(trees[a].query(trees[b].data)[0] < NEAR).mean() for a, b in (pair, pair[::-1])]
        return min(near)

    return sorted(combinations(range(len(pieces)), 2), key=share, reverse=True)[:count]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("thing", choices=["venus", "cake", "brick"])
    parser.add_argument("--pairs", type=int, help="the pairs with the largest breaks instead of all parts")
    parser.add_argument("--parts", type=int, nargs="+", help="these parts, from 1, instead of all")
    parser.add_argument("--alone", action="store_true", help="from the pieces alone, without the whole")
    parser.add_argument("--seeds", type=int, default=1)
    options = parser.parse_args()
    pieces = [reconstruct(path) for path in fetch_fracture() if path.stem.startswith(options.thing)]
    chosen = [[k - 1 for k in options.parts]] if options.parts else [list(range(len(pieces)))]
    if options.pairs:
        chosen = touching(pieces, options.pairs)
    right, seconds = [], []
    for numbers in chosen:
        parts = [pieces[i] for i in numbers]
        for seed in range(options.seeds):
            bodies, truth = scatter(parts, seed)
            began = time.monotonic()
            found = assemble_alone(bodies, seed) if options.alone else assemble(bodies, Container(joined(parts)), seed)
            seconds.append(time.monotonic() - began)
            right.append(measure(bodies, found.matrices, truth).parts)
            names = "+".join(f"{i + 1:02d}" for i in numbers)
            print(f"{options.thing} {names} seed {seed}: {right[-1]:.2f} of the parts, {seconds[-1]:.1f} s", flush=True)
    print(
        f"accuracy {np.mean(right):.3f} in the mean, all right in {sum(r == 1 for r in right)} of {len(right)}; "
        f"{np.mean(seconds):.1f} s in the mean, {max(seconds):.1f} at most"
    )


if __name__ == "__main__":
    main()
