"""Likeness of heaps to their pictures, and seconds, over letters, pictures, four views and perspective.

python tests/benchmarks/art_table.py [--kitchen] [--cases cartoons ...] [--paint]

--kitchen : the real Kitchen objects by registry, instead of objects that the kit makes. Cases that need the authors'
pictures fetch them by registry; four views and perspective show a heart, a star, a moon and the heart again.
Silhouettes are judged by rays, not by the renderer that drew them.
"""

import argparse
import shutil
import sys
import time
from pathlib import Path

import numpy as np

from data_fetch import drawn, fetch_kitchen, fetch_targets, kitchen_like
from rasp_core.art import anamorphic, glyphs, texturing
from rasp_core.art.views import cameras_for
from rasp_core.geometry.loading import load_bodies
from rasp_core.io import images
from rasp_core.silhouettes import likeness

sys.path.insert(0, str(Path(__file__).parent.parent))
from oracles import read_letters

SIZE = 512
CARTOONS = {"cartoons": ((0, 90), (0, 1)), "cartoons 120": ((0, 120), (0, 1)), "three": ((0, 120, 240), (0, 1, 2))}
LETTERS = ("C2", "V0", "P2", "R5")
DRAWN = {
    "four views": (4, "orthographic"),
    "two perspective": (2, "perspective"),
    "three perspective": (3, "perspective"),
}


def case(name):
    """Cameras, dark pixels and colours (None where there are none) of a case."""
    if name in DRAWN:
        count, projection = DRAWN[name]
        pictures = [*drawn.shapes(SIZE).values()] * 2
        return cameras_for(count, width=1.0, projection=projection), np.stack(pictures[:count]), None
    if name in CARTOONS:
        azimuths, chosen = CARTOONS[name]
        paths = {path.stem: path for path in fetch_targets()}
        named = [paths[stem] for stem in ("cartoon1", "cartoon2", "cartoon1f")]
        return cameras_for(len(chosen), azimuths, width=1.0), *images.read_targets([named[k] for k in chosen], SIZE)
    cameras = cameras_for(len(name), [0, 90, 0][: len(name)], [0, 0, 90][: len(name)], width=1.0)
    return cameras, glyphs.letters(list(name), SIZE, square=len(name) == 3)[0], None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kitchen", action="store_true")
    parser.add_argument(
        "--cases", nargs="+", default=[*CARTOONS, *LETTERS, "GEB", *DRAWN], choices=[*CARTOONS, *LETTERS, "GEB", *DRAWN]
    )
    parser.add_argument("--paint", action="store_true", help="what has colours")
    options = parser.parse_args()
    pool = load_bodies(fetch_kitchen()) if options.kitchen else kitchen_like(120)
    read = {}
    for name in options.cases:
        cameras, dark, colours = case(name)
        colours = colours if options.paint else None
        began = time.monotonic()
        made = anamorphic.sculpt(pool, dark, cameras, colours=colours)
        seconds = time.monotonic() - began
        canvas = texturing.Canvas(made.bodies, made.matrices, made.cameras, SIZE)
        seen = canvas.project(np.ones((*dark.shape, 3))).seen
        read[name], alike = seen, likeness(seen, made.hull)
        print(
            f"{name}: {len(made.bodies)} objects, of the ceiling {' '.join(f'{x:.3f}' for x in alike)}, ceiling "
            f"{' '.join(f'{x:.3f}' for x in made.ceiling)}, certified {made.certificate.holds}, {seconds:.0f} s",
            flush=True,
        )
        if colours is not None:
            began = time.monotonic()
            painted = canvas.paint(colours)
            took = time.monotonic() - began
            for way, result in (("painted", painted), ("projected", canvas.project(colours))):
                noise, similar = result.psnr, result.ssim
                shown = f"PSNR {' '.join(f'{x:.1f}' for x in noise)} dB, SSIM {' '.join(f'{x:.2f}' for x in similar)}"
                print(f"  {way}: {shown}" + (f", {took:.0f} s" if result is painted else ""), flush=True)
    if set(LETTERS) <= set(read) and shutil.which("tesseract"):
        lines = [read_letters([read[name][k] for name in LETTERS]) for k in range(2)]
        print(f"Tesseract reads {lines[0]!r} and {lines[1]!r}")


if __name__ == "__main__":
    main()
