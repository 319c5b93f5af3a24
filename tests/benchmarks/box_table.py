"""The smallest box that is found for all objects of a pool, seed after seed.

python tests/benchmarks/box_table.py [--pool embedded] [--shape auto] [--seeds 5] [--seconds 60]

embedded: 24 objects of `kitchen_like`. Kitchen: all 106 of the real pool, for which --shape auto:cube --seconds 240 is
meant. Each packing is certified anew.
"""

import argparse
import time

import numpy as np
import pools

import data_fetch
import rasp_core as rasp
from rasp_core.exact.certificate import certify

POOLS = {"embedded": lambda: data_fetch.kitchen_like(24), "Kitchen": pools.POOLS["Kitchen"]}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pool", default="embedded", choices=POOLS)
    parser.add_argument("--shape", default="auto", help="auto, auto:cube or auto:X,Y,*")
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(5)))
    parser.add_argument("--seconds", type=float, default=60)
    options = parser.parse_args()
    pool, densities = POOLS[options.pool](), []
    for seed in options.seeds:
        began = time.monotonic()
        packed = rasp.pack(pool, options.shape, "dense", time_limit=options.seconds, seed=seed)
        holds = certify(packed.bodies, packed.matrices, packed.container).holds and len(packed.bodies) == len(pool)
        densities.append(packed.density if holds else 0.0)
        edges = " x ".join(f"{edge:.4f}" for edge in packed.container.size)
        verdict = "certified" if holds else "NOT certified"
        print(
            f"seed {seed}: {packed.density:.4f} in {edges} m, {verdict}, {time.monotonic() - began:.0f} s", flush=True
        )
    print(f"mean {np.mean(densities):.4f}, worst {min(densities):.4f}")


if __name__ == "__main__":
    main()
