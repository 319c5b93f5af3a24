"""Packings at rest, by seeds: how many objects, how dense, and how far a point of any moves in two seconds of MuJoCo.

python tests/benchmarks/gravity_table.py [--seeds 10] [--pool embedded|Kitchen] [--time-limit 20]

The dense search fills 0.2 x 0.2 x 0.2 m of embedded objects, or 0.32 x 0.32 x 0.30 m of Kitchen by registry. What is
written is read back, and stands in a simulation that is begun anew from the file.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np
from pools import POOLS

import data_fetch
import rasp_core as rasp
from rasp_core.exact.certificate import certify
from rasp_core.physics.falling import Fall
from rasp_core.poses import file_to_world, from_matrices
from rasp_core.visualize import gltf

ROOMS = {"embedded": (0.2, 0.2, 0.2), "Kitchen": (0.32, 0.32, 0.30)}
SECONDS = 2.0


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--pool", default="embedded", choices=ROOMS)
    parser.add_argument("--time-limit", type=float, default=20.0, help="seconds of the search")
    options = parser.parse_args()
    embedded = options.pool == "embedded"
    pool = data_fetch.kitchen_like(48) if embedded else POOLS["Kitchen"]()
    for seed in range(options.seeds):
        began = time.monotonic()
        room = rasp.box(*ROOMS[options.pool])
        packed = rasp.pack(pool, room, "dense", time_limit=options.time_limit, seed=seed, gravity=True)
        seconds = time.monotonic() - began
        with tempfile.TemporaryDirectory() as folder:
            bodies, container = gltf.read_scene(packed.save(Path(folder) / "run"))
        stay = np.tile(np.eye(4), (len(bodies), 1, 1))
        certificate = certify(bodies, stay, container)
        after = Fall(bodies, container).run(from_matrices(bodies, stay), SECONDS, until_rest=False).poses
        placed = file_to_world(bodies, after.rotation, after.translation)
        moved = max(
            np.linalg.norm(body.placed(matrix) - body.vertices, axis=1).max()
            for body, matrix in zip(bodies, placed, strict=True)
        )
        print(
            f"{options.pool}, seed {seed}: {packed}, {packed.resting.summary('mm')}; "
            f"{seconds:.0f} s; read back {'certified' if certificate.holds else 'NOT certified'}, "
            f"moved by {1000 * moved:.3f} mm at most",
            flush=True,
        )


if __name__ == "__main__":
    main()
