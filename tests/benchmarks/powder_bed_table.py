"""A powder bed's order: 226 parts on a base of 335 x 335 mm, 2 mm apart, beside a column that stays free.

python tests/benchmarks/powder_bed_table.py [--seconds 600] [--arms dense dblf spectral boxes] [--parts N] [--draw]

How low can it be? powder_bed_order.csv beside this file is the order: 40 kinds of the CAD and Kitchen sets, drawn with
a seed (--draw draws it anew). dense, dblf, spectral : the kit's methods, whose packings come apart through the top
(--separable), certified. boxes : the parts' bounding boxes with what is kept clear, by py3dbp (`pip install
py3dbp==1.1.2`), which knows no column and has the whole base; its height is halved down to a millimetre.
"""

import argparse
import csv
import time
from pathlib import Path

import numpy as np
import trimesh

import data_fetch
import rasp_core as rasp
from rasp_core.geometry.meshes import make_body
from rasp_core.reproduce.pools import resized

ORDER = Path(__file__).with_name("powder_bed_order.csv")
BASE, CLEARANCE, COLUMN = 0.335, 0.002, (0.02, (0.08, 0.05))  # metres; radius and middle
PARTS, KINDS, SEED = 226, 40, 0
SCALES = {"CAD": (0.6, 1.0), "Kitchen": (0.4, 0.7)}


def sets():
    """The parts of each set by name."""
    cad, kitchen = resized(rasp.load(data_fetch.fetch_cad())), rasp.load(data_fetch.fetch_kitchen())
    return {"CAD": {body.name: body for body in cad}, "Kitchen": {body.name: body for body in kitchen}}


def draw():
    """Write the order."""
    random, rows = np.random.default_rng(SEED), []
    for name, parts in sets().items():
        for part in random.choice(sorted(parts), KINDS // 2, replace=False):
            scale, turns = random.uniform(*SCALES[name]), "z" if random.random() < 0.15 else "any"
            rows.append([name, part, 1, turns, f"{scale:.2f}"])
    for k in random.choice(KINDS, PARTS - KINDS, p=random.dirichlet(np.ones(KINDS))):
        rows[k][2] += 1
    with ORDER.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([["set", "part", "count", "turns", "scale"], *rows])


def ordered(most):
    """The order's items; the first so many parts of it."""
    found, parts = [], sets()
    with ORDER.open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            count = min(int(row["count"]), most - sum(item.count for item in found))
            body = parts[row["set"]][row["part"]]
            found.append(rasp.Item(body, count=count, turns=row["turns"], scale=float(row["scale"])))
    return [item for item in found if item.count]


def packed_height(items, method, seconds):
    """The height in metres, and what is to be said of it."""
    radius, (x, y) = COLUMN
    post = trimesh.creation.cylinder(radius, 2.0, sections=48)
    column = make_body("column", post.vertices + np.array([x, y, 1.0]), post.faces)
    asked = {"clearance": CLEARANCE, "separable": True, "keep_out": [column], "time_limit": seconds}
    found = rasp.pack(items, f"auto:{BASE},{BASE},*", method, progress=True, **asked)
    whole = found.certificate.holds and found.dismantling.holds and len(found.bodies) == found.pool
    told = f"density {found.density:.3f}, least gap {1000 * found.certificate.gaps.least.gap:.3f} mm"
    return found.container.base.size[2], f"{told}, {'certified, comes apart' if whole else 'NOT as asked'}"


def boxes_height(items):
    """The least height in metres, to a millimetre, of a box into which py3dbp packs the bounding boxes."""
    import py3dbp

    edges = [2e3 * body.half_extents + 1e3 * CLEARANCE for item in items for body in item.bodies()]
    room = 1e3 * (BASE - CLEARANCE)  # what is about each box counts once between two and half at a wall

    def fits(height):
        packer = py3dbp.Packer()
        packer.add_bin(py3dbp.Bin("bed", room, room, height, 1e9))
        for k, edge in enumerate(edges):
            packer.add_item(py3dbp.Item(str(k), *edge, 1))
        packer.pack(bigger_first=True)
        return len(packer.bins[0].items) == len(edges)

    low, high = 0.0, 500.0
    while not fits(high):
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) / 2
        low, high = (low, middle) if fits(middle) else (middle, high)
    return (high + 1e3 * CLEARANCE) / 1e3, "bounding boxes, without the column"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--arms", nargs="+", default=["dense", "dblf", "boxes"])
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--parts", type=int, default=PARTS)
    parser.add_argument("--draw", action="store_true", help="draw the order anew")
    options = parser.parse_args()
    if options.draw:
        draw()
    items, heights = ordered(options.parts), {}
    print(f"{sum(item.count for item in items)} parts of {len(items)} kinds, {options.seconds:g} s", flush=True)
    for arm in options.arms:
        began = time.monotonic()
        heights[arm], told = boxes_height(items) if arm == "boxes" else packed_height(items, arm, options.seconds)
        print(f"{arm}: {1000 * heights[arm]:.1f} mm, {told}, {time.monotonic() - began:.0f} s", flush=True)
    for arm in options.arms[1:]:
        print(f"{options.arms[0]} is {1 - heights[options.arms[0]] / heights[arm]:.1%} lower than {arm}")


if __name__ == "__main__":
    main()
