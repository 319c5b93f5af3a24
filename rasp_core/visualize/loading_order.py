"""How a container is loaded, part by part: pulls that take a packing apart, backwards, as a recording."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..exact.pulls import Dismantling
from ..geometry.cameras import box_views
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..objective import LOSS_NAMES
from .recording import Recording, Run

FRAMES = 16  # of each part's way
MOST_FRAMES = 4000  # of all; where parts are many, each has fewer
FEWEST_OF_A_PART = 4
LIFT = 0.25  # of the container's height, above its top: where a part's way begins
VIEW = 2.2  # edge of what is seen, over the container's extent: parts come from above


class LoadingOrder(Recording):
    """Parts go into the container one after the other, each along a straight line, and none through another.

    bodies placed by `matrices` `(N, 4, 4)` as they lie at last. What no pull frees is there from the start, as what is
    fixed is. A notebook's cell shows it, `save` writes it as a page.
    """

    title = "How the container is loaded"

    def __init__(self, bodies: Sequence[Body], matrices: np.ndarray, container: Container, dismantling: Dismantling):
        self.loaded = list(reversed(dismantling.pulls))
        each = int(np.clip(MOST_FRAMES // max(1, len(self.loaded)), FEWEST_OF_A_PART, FRAMES))
        rotation = np.asarray(matrices)[:, :3, :3]
        ends = matrices[:, :3, 3] + np.einsum("nij,nj->ni", rotation, [body.centre for body in bodies])
        numbers = {body.name: i for i, body in enumerate(bodies)}
        going = [numbers[pull.name] for pull in self.loaded]
        present = np.ones((1 + each * len(going), len(bodies)), bool)
        places = np.tile(ends, (len(present), 1, 1))
        self.stops = []
        lift = LIFT * float(np.ptp(container.bounds[:, 2]))
        for n, (i, pull) in enumerate(zip(going, self.loaded, strict=True)):
            first = 1 + n * each
            present[:first, i] = False
            up = np.array(pull.direction)
            away = (pull.length + lift / up[2]) * np.linspace(1, 0, each)
            places[first : first + each, i] = ends[i] + away[:, None] * up
            self.stops.append(first + each - 1)
        frames = len(present)
        run = Run(
            values={},
            iterations=np.arange(frames),
            total=frames - 1,
            rotation=np.tile(rotation, (frames, 1, 1, 1)),
            translation=places,
            present=present,
            losses=np.full((frames, len(LOSS_NAMES)), np.nan),
            overlap=np.full(frames, np.nan),
        )
        low, high = container.bounds
        super().__init__(bodies, container, [run], box_views(VIEW * float((high - low).max()), (low + high) / 2))

    def encoded(self) -> dict:
        """As plain values for JSON, see `recording_format`."""
        words = []
        for pull in self.loaded:
            slant = float(np.degrees(np.arccos(min(1.0, pull.direction[2]))))
            words.append(pull.name if slant == 0 else f"{pull.name} (at {slant:.0f}°)")
        names = [pull.name for pull in self.loaded]
        return super().encoded() | {"loading": {"names": names, "words": words, "stops": self.stops}}

    def __repr__(self) -> str:
        return f"<Loading of {len(self.loaded)} objects, one by one>"
