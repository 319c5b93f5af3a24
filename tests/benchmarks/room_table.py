"""Heaps in rooms: the shadows on wall and floor, by rays that know nothing of the kit's cameras.

python tests/benchmarks/room_table.py [--resolution 256] [--time-limit 120]

One lamp 1 m before a wall, one above a floor that is tilted by 14 degrees; pairs of letters, and of drawn shapes.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from PIL import Image

import rasp_core as rasp
from data_fetch import drawn, kitchen_like
from rasp_core.art.room_file import room_of

sys.path.insert(0, str(Path(__file__).parent.parent))
from oracles import iou, thrown

ROOM = {
    "heap": [0, 0, 1],
    "surfaces": {
        "wall": {"point": [0, 0.45, 0], "normal": [0, -1, 0]},
        "floor": {"point": [0, 0, 0.55], "normal": [0, -0.25, 1]},
    },
    "lamps": [
        {"at": [0, -0.55, 1], "onto": "wall", "height": 0.42},
        {"at": [0, 0, 1.7], "onto": "floor", "height": 0.4},
    ],
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--resolution", type=int, default=256)
    parser.add_argument("--time-limit", type=float, default=120.0)
    options = parser.parse_args()
    room, pool = room_of(ROOM), kitchen_like(120)
    slope = np.hypot(1, 0.25)
    along = np.array([0, 1, 0.25]) / slope
    squares = [([0, 0.45, 1], [1, 0, 0], [0, 0, 1], 0.42), ([0, 0, 0.55], [1, 0, 0], along, 0.4)]
    shapes = drawn.shapes(options.resolution)
    with tempfile.TemporaryDirectory() as place:
        paths = [Path(place) / f"{name}.png" for name in ("heart", "star")]
        for path in paths:
            Image.fromarray(np.where(shapes[path.stem], 0, 255).astype(np.uint8)).save(path)
        for name, asked in (("C2", {"text": ["C", "2"]}), ("heart, star", {"targets": paths})):
            began = time.monotonic()
            heap = rasp.sculpt(pool, **asked, room=room, resolution=options.resolution, time_limit=options.time_limit)
            seconds, there = time.monotonic() - began, heap.in_room
            vertices = there.surface[0] + [0, 0, 1]
            cast = [
                thrown(vertices, there.surface[1], throw.at, *square, options.resolution)
                for throw, square in zip(room.throws, squares, strict=True)
            ]
            alike = [iou(shadow, picture) for shadow, picture in zip(cast, there.wanted, strict=True)]
            cast, kits, ceiling = (
                " ".join(f"{x:.3f}" for x in values) for values in (alike, there.likeness, heap.art.ceiling)
            )
            print(
                f"{name}: {len(heap.bodies)} objects, shadows like their pictures {cast} by rays, {kits} by the kit, "
                f"ceiling {ceiling}; {seconds:.0f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
