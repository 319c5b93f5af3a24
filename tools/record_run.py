"""Record the runs that the site shows: a dozen objects, arranged with each of some lambdas and epsilons.

python tools/record_run.py docs/recorded_run.json
"""

import sys
from pathlib import Path

import rasp_core as rasp
from data_fetch import kitchen_like
from rasp_core.problem import Settings

COUNT, EDGE, FRAMES = 12, 0.26, 26
LAMBDAS, EPSILONS = (0.001, 0.1, 10.0), (0.001, 0.01, 0.05)
SETTINGS = Settings(iterations=200, resolution=128, seed=0)


def record(path: Path) -> None:
    """Write the recording to `path`."""
    bodies, box = kitchen_like(COUNT, seed=SETTINGS.seed), rasp.box(EDGE, EDGE, EDGE)
    rasp.record(bodies, box, SETTINGS, lambdas=LAMBDAS, epsilons=EPSILONS, frames=FRAMES).save(path)


if __name__ == "__main__":
    record(Path(sys.argv[1]))
