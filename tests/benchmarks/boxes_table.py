"""As few boxes as are found for many objects of a pool, beside what their volumes ask for.

python tests/benchmarks/boxes_table.py [--count 100] [--in-turn] [--edge 0.2] [--seconds 1000] [--seed 0]

Draws of General, or its objects in turn until there are so many, in cubes of an edge in metres; what fits into no cube
is named. Asked for are at most the volume of what fits over 0.55 of a cube's, in boxes.
"""

import argparse
import itertools

import data_fetch
import rasp_core as rasp
from rasp_core.geometry.meshes import unique_names
from rasp_core.packing.pool import draw

ASKED = 0.55  # of all boxes together


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--in-turn", action="store_true", help="no draws")
    parser.add_argument("--edge", type=float, default=0.2)
    parser.add_argument("--seconds", type=float, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    pool = rasp.load(data_fetch.fetch_general())
    in_turn = unique_names(list(itertools.islice(itertools.cycle(pool), options.count)))
    bodies = in_turn if options.in_turn else draw(pool, options.count, 0)
    box = rasp.box(*[options.edge] * 3)
    found = rasp.pack_boxes(bodies, box, "dense", seed=options.seed, time_limit=options.seconds)
    left = {body.name for body in found.left}
    asked = sum(body.volume for body in bodies if body.name not in left) / box.volume / ASKED
    densities = " ".join(f"{packed.density:.3f}" for packed in found)
    print(f"{len(found)} boxes, at most {asked:.2f} are asked for; {'all' if found.certified else 'NOT all'} certified")
    print(f"densities {densities}; {found.seconds:.0f} s")
    print(f"in none, as they are too large: {', '.join(sorted(left)) or 'nothing'}")


if __name__ == "__main__":
    main()
