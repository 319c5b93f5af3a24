"""The smallest box that holds all objects: the container as an unknown.

1. A baseline places all of them, the largest first, in a box that grows along its free edges until it holds them: a
   first answer. Then what it can in a smaller box, and what is left over is pressed into the voids one by one.
2. Again and again: the box is drawn in a little, everything with it; an object goes where it overlaps least; all are
   pressed apart (`pressing`). What holds is kept, so that there is a certified packing at any time.

The question is that of Gupta & Raman 2026, Differentiable Packing of Irregular 3D Objects with Adaptive Container
Estimation.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch

from .arrange import file_to_world
from .baselines import Placement
from .budget import Budget
from .certify import certify, placed_solid
from .containers import Container, FreeBox, box
from .errors import InputError
from .meshes import Body
from .packing import Packing, check_sizes, finish, progress_bar
from .pressing import Press, join
from .problem import Settings, Start
from .scene import resolve_device

EFFORT = 100  # tries, where no time is given
FIRST_DENSITY = 0.5  # of the box in which the placement of all begins
FULL_DENSITY = 0.62  # of the box in which the search begins
FILL_SHARE = 0.5  # of the budget, after which the first placement is squeezed instead
GROWTH = 0.01  # of its volume, or half the share of the objects that are left over, where that is more
PATIENCE = 2  # objects in a row that could not be pressed in, after which it grows
BATCH = 8  # objects pressed in at once, at most
MOVES = 4  # objects looked at for moving
FIRST_STEP, LARGEST_STEP, SMALLEST_STEP = 0.006, 0.03, 2e-4  # shares of the volume that the box loses at once
HELD, FAILED = 1.3, 0.85  # what the step is multiplied by
MOVED = 0.5  # share of the tries that put an object elsewhere


def pack(
    bodies: Sequence[Body],
    shape: FreeBox,
    settings: Settings | None = None,
    device: str | torch.device = "cpu",
    time_limit: float | None = None,
    effort: int | None = None,
    progress: bool = False,
    rule: str | None = None,
) -> Packing:
    """All `bodies` in the smallest box of a shape that is found, certified.

    rule : None for the search above; a name of `baselines.RULES` for that baseline alone, placing all in shaken orders
    until time is over. time_limit : seconds. effort : number of tries (further placements, for a rule), `EFFORT`
    (none) where neither is given. settings : seed, resolution and query points count. Ctrl-C and the time limit
    return the best so far, but for the first placement, which is made in any case.

    Raises InputError for no bodies, a negative effort, or bodies that no box with the fixed edges holds.
    """
    settings = settings or Settings()
    if effort is None and time_limit is None:
        effort = EFFORT if rule is None else 0
    budget = Budget(time_limit, effort)
    check_sizes(bodies, box([_longest(bodies) if e is None else e for e in shape.edges]))
    search = _Search(bodies, shape, settings, device, budget, progress, rule)
    try:
        search.place(rule or "spectral")
        if rule is None and not budget.over():
            search.fill()
        while not budget.over():
            search.try_placement() if rule else search.squeeze()
    except KeyboardInterrupt:
        if search.container is None:
            raise
        search.interrupted = True
    finally:
        search.bar.close()
    return search.result()


class _Search:
    """A search under way: poses of all bodies that hold in `container`."""

    def __init__(self, bodies, shape, settings, device, budget, progress, rule):
        self.bodies, self.shape, self.settings = list(bodies), shape, settings
        self.device = resolve_device(device)
        self.budget = budget
        self.random = np.random.default_rng(settings.seed)
        self.volumes = np.array([body.volume for body in bodies])
        self.container: Container | None = None
        self.start: Start | None = None
        self.press: Press | None = None
        self.step, self.interrupted = FIRST_STEP, False
        self.rounds: list[dict] = []
        self.bar = progress_bar(f"smallest box, {rule or 'dense'}", "try", progress, budget.effort)

    # -- placing -----------------------------------------------------------------------------------------------------

    def place(self, rule: str) -> None:
        """The first box, by a baseline."""
        first = self.shape.sized(self.volumes.sum() / FIRST_DENSITY)
        self.placement = Placement(self.bodies, box(first), self.settings.seed, rule)
        if self.placement.coarse:  # cubes may leave nothing between them, and growing costs little
            self.placement.enter(box(self.shape.sized(self.volumes.sum())))
        self._grow(None)

    def try_placement(self) -> None:
        """Place anew in a shaken order; the box starts a little below the best."""
        self.budget.tries += 1
        self.bar.update()
        self.placement.enter(box(self.shape.sized(0.97 * self.container.volume)))
        self._grow(self.placement.shaken())

    def _grow(self, order: np.ndarray | None) -> None:
        """Place all, the box growing by a voxel at a time; given up where it would be no smaller than the best, and,
        where there is a best, when time is over."""
        longest, edges = _longest(self.bodies), self.placement.container.size

        def late() -> bool:
            return self.container is not None and self.budget.spent()

        while True:
            self.placement.fill(order, late)
            if len(self.placement.placed) == len(self.bodies):
                break
            shortest = np.arange(3) == np.where(self.shape.free, edges, np.inf).argmin()
            edges = edges + self.placement.room.voxel * (self.shape.free if self.shape.cube else shortest)
            if np.prod(edges) >= self.least or late():
                return
            if edges[self.shape.free].min() > (longest + 2 * self.placement.room.voxel) * len(self.bodies):
                raise InputError("not all objects fit between the fixed edges; make them longer, or free them with *")
            self.placement.enter(box(edges), keep=True)
        backwards = np.argsort(list(self.placement.placed))
        self._keep(*self._drawn_in(self.placement.start.take(backwards)))

    # -- pressing ----------------------------------------------------------------------------------------------------

    def fill(self) -> None:
        """Begin anew in a small box: what does not go in by placing is pressed in, the box growing where that fails."""
        edges = self.shape.sized(self.volumes.sum() / FULL_DENSITY)
        self.press = Press(self.bodies, box(edges), self.settings, self.device, self.random, self.budget.spent)
        if self.least <= np.prod(edges):
            return
        self.placement.enter(box(edges))
        self.placement.fill(stop=self.budget.spent)
        chosen, start = list(self.placement.placed), self.placement.start
        batch, failed = BATCH, 0
        while len(chosen) < len(self.bodies) and not self.budget.over(FILL_SHARE):
            self.budget.tries += 1
            self.bar.update()
            more, there = self.press.add(chosen, start, batch, np.inf)
            fresh, seed = len(more) - len(chosen), self.settings.seed + self.budget.tries
            settled = self.press.press_in(more, there, seed, fresh) if fresh else None
            if settled is not None:
                chosen, start, failed, batch = more, settled, 0, min(2 * batch, BATCH)
                continue
            failed, batch = failed + (batch == 1), max(1, batch // 2)
            if failed == PATIENCE:
                left = 1 - self.volumes[chosen].sum() / self.volumes.sum()
                larger = self.shape.sized(np.prod(edges) * (1 + max(GROWTH, left / 2)))
                start = Start(start.rotation, start.translation * torch.from_numpy(larger / edges))
                edges, failed = larger, 0
                self.press.enter(box(edges))
        if len(chosen) == len(self.bodies):
            self._keep(*self._drawn_in(start.take(np.argsort(chosen))))

    def squeeze(self) -> None:
        """One try to do with a smaller box."""
        self.budget.tries += 1
        self.bar.update()
        edges = self._smaller()
        shrink = torch.from_numpy(edges / self.container.size)
        start = Start(self.start.rotation, self.start.translation * shrink)
        self.press.enter(box(edges))
        order = list(range(len(self.bodies)))
        if self.random.random() < MOVED:
            order, start = self._moved(order, start)
        held = self.press.press_in(order, start, self.settings.seed + self.budget.tries)
        self.step *= FAILED if held is None else HELD
        self.step = float(np.clip(self.step, SMALLEST_STEP, LARGEST_STEP))
        if held is not None:
            self._keep(*self._drawn_in(held.take(np.argsort(order))))

    def _smaller(self) -> np.ndarray:
        """The edges of the next box to try: all free edges shorter, or a random one of them."""
        shorter = self.shape.free.copy()
        if not self.shape.cube and self.random.random() < 0.5:
            shorter = np.arange(3) == self.random.choice(np.flatnonzero(shorter))
        edges = self.container.size.copy()
        edges[shorter] *= (1 - self.step) ** (1 / shorter.sum())
        return edges

    def _moved(self, order: list[int], start: Start) -> tuple[list[int], Start]:
        """One object, the easiest of some, goes where it shares least with the others."""
        moved, least = (order, start), np.inf
        for out in self.random.choice(order, min(MOVES, len(order)), replace=False).tolist():
            rest = [index for index in order if index != out]
            self.press.look(order, start, out)
            found = self.press.least_shared([out], least * self.volumes[out])
            if found is not None:
                moved, least = ([*rest, out], join(start.take(rest), found[1])), found[2] / self.volumes[out]
        return moved

    # -- the record --------------------------------------------------------------------------------------------------

    def _drawn_in(self, start: Start) -> tuple[Container, Start]:
        """The box of the shape that just holds the objects as they lie, and their poses in it."""
        matrices = file_to_world(self.bodies, start.rotation, start.translation)
        solids = [placed_solid(body, matrix) for body, matrix in zip(self.bodies, matrices, strict=True)]
        bounds = np.array([solid.bounding_box() for solid in solids]).reshape(-1, 2, 3)
        low, high = bounds[:, 0].min(0), bounds[:, 1].max(0)
        edges = np.array([size if e is None else e for size, e in zip(high - low, self.shape.edges, strict=True)])
        if self.shape.cube:
            edges[:] = edges.max()
        fits = edges >= high - low
        middle = np.where(self.shape.free | fits, (low + high) / 2, 0.0)
        return box(edges), Start(start.rotation, start.translation - torch.from_numpy(middle))

    @property
    def least(self) -> float:
        """Volume of the smallest box so far, cubic metres."""
        return np.inf if self.container is None else self.container.volume

    def _keep(self, container: Container, start: Start) -> None:
        if container.volume >= self.least:
            return
        matrices = file_to_world(self.bodies, start.rotation, start.translation)
        if certify(self.bodies, matrices, container).holds:
            self.container, self.start = container, start
            density = float(self.volumes.sum() / container.volume)
            self.rounds.append({"tries": self.budget.tries, "box": container.size.tolist(), "density": density})
            self.bar.set_postfix_str(f"{' x '.join(f'{e:.4f}' for e in container.size)} m, density {density:.4f}")

    def result(self) -> Packing:
        """The smallest box, certified anew."""
        history = self.press.history if self.press else ()
        everything = list(range(len(self.bodies)))
        record = history, self.rounds, self.interrupted
        return finish(self.bodies, everything, self.start, self.container, self.settings, self.device, *record)


def _longest(bodies: Sequence[Body]) -> float:
    """A length that no body exceeds, however it is turned."""
    return max((2 * body.radius for body in bodies), default=1.0)
