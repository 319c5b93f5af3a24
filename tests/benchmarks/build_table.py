"""Heaps made one piece each, or hung up: closed, hidden struts or threads, likeness with them, standing; and seconds.

python tests/benchmarks/build_table.py [--cases C2 three ...] [--kitchen] [--hang]

Pairs of letters, and three pictures that are drawn (heart, star, moon); cartoons are the authors' pictures, fetched by
registry. The STL is read back by trimesh, and likeness is judged by rays, above the base, not by the kit's renderer.
With --hang the heap is put on threads instead.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import torch
import trimesh
from PIL import Image

import rasp_core as rasp
from data_fetch import drawn, fetch_kitchen, fetch_targets, kitchen_like
from rasp_core.art.hiding import Hiding
from rasp_core.geometry.loading import load_bodies
from rasp_core.geometry.meshes import make_body

sys.path.insert(0, str(Path(__file__).parent.parent))
from oracles import cast_mask, iou

SIZE = 512
LETTERS = ("C2", "V0", "P2", "R5")
CARTOONS = ("cartoon1", "cartoon2", "cartoon1f")


def asked(name, folder):
    """What `rasp.sculpt` is asked in a case."""
    if name in LETTERS:
        return {"text": list(name)}
    if name == "three":
        for stem, picture in drawn.shapes(SIZE).items():
            Image.fromarray(np.where(picture, 0, 255).astype(np.uint8)).save(folder / f"{stem}.png")
        return {"targets": sorted(folder.glob("*.png"))}
    paths = {path.stem: path for path in fetch_targets()}
    return {"targets": [paths[stem] for stem in CARTOONS[: {"cartoons": 2, "cartoons three": 3}[name]]]}


def cast_of_ceiling(mesh, built):
    """Intersection over union with the ceiling, above the base, by rays."""
    art = built.built.sculpture
    body = make_body(
        "read", (np.asarray(mesh.vertices) - built.built.shift) / built.built.scale, np.asarray(mesh.faces)
    )
    bottom = Hiding.of(art.hull, art.hull, art.cameras).bottom
    turn, found = torch.eye(3, dtype=torch.float64)[None], []
    for k, camera in enumerate(art.cameras):
        seen = cast_mask([body], turn, torch.tensor(body.centre[None]), camera, SIZE)
        seen[bottom[k] :] = False
        found.append(iou(seen, art.hull[k]))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    cases = [*LETTERS, "three", "cartoons", "cartoons three"]
    parser.add_argument("--cases", nargs="+", default=[*LETTERS, "three"], choices=cases)
    parser.add_argument("--kitchen", action="store_true", help="the real Kitchen objects by registry")
    parser.add_argument("--hang", action="store_true", help="on threads")
    parser.add_argument("--time-limit", type=float, default=120.0, help="seconds after which no other width is tried")
    options = parser.parse_args()
    pool = load_bodies(fetch_kitchen()) if options.kitchen else kitchen_like(120)
    for name in options.cases:
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            heap = rasp.sculpt(pool, **asked(name, folder), time_limit=options.time_limit)
            began = time.monotonic()
            if options.hang:
                hung = heap.hang()
                print(f"{name}: {hung.headline()}; {time.monotonic() - began:.0f} s", flush=True)
                continue
            built = heap.build()
            seconds = time.monotonic() - began
            mesh = trimesh.load(built.save(folder / "run") / "built.stl")
            print(
                f"{name}: {len(heap.bodies)} objects, {len(built.built.struts)} struts, "
                f"{' x '.join(f'{edge:.0f}' for edge in np.ptp(mesh.bounds, axis=0))} mm, closed {mesh.is_watertight}, "
                f"{mesh.body_count} piece; of the ceiling {' '.join(f'{x:.3f}' for x in cast_of_ceiling(mesh, built))} "
                f"(heap {' '.join(f'{x:.3f}' for x in heap.art.of_ceiling)}); {built.standing.line()}; {seconds:.0f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
