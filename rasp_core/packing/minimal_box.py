"""The smallest box that holds all objects: the container as an unknown.

1. A baseline places all of them, the largest first, in a box that grows along its free edges until it holds them: a
   first answer.
2. In a box a few per cent too small all are pressed apart as far as they go (`relaxing`). Again and again two change
   places, or one turns (`moves`), and all are pressed apart anew; what overlaps less is kept.
3. When much less overlaps the box grows until nothing does: by samples, then by exact booleans. What is smaller than
   the best is kept, and the box made too small again, so that there is a certified packing at any time.

The question is that of Gupta & Raman 2026, Differentiable Packing of Irregular 3D Objects with Adaptive Container
Estimation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch

from ..exact.certificate import TOLERANCE, certify, placed_solid
from ..exact.overlap_removal import mend
from ..geometry.containers import Container, FreeBox, box
from ..geometry.meshes import Body
from ..geometry.sdf import GridStack
from ..poses import Poses, file_to_world
from ..problem import Settings
from ..util.budget import Budget
from ..util.devices import resolve_device
from ..util.errors import InputError
from .constructive import Placement
from .contact_solver import Relaxation
from .moves import Moves
from .result import Packing, check_sizes, finish, progress_bar
from .separation import NEARLY, STRICT

EFFORT = 2000  # tries, where no time is given
FIRST_DENSITY = 0.5  # of the box in which the placement of all begins
OVER = 0.05  # of its volume, by which the box searched in is smaller than the best
BATCH = 8  # moves looked at in a try, of which the best may be kept
RESHAPED, RESHAPING = 0.1, 0.01  # share of the tries in which free edges change, and by how much
SPACING = 6.0  # between surface samples while searching, in cells of a body's grid
GAP = 5e-4  # of a mean body's radius, that each keeps from what is about it
FIRST_STEPS, STEPS = 3, 40  # of pressing apart, before it may be given up, and at most
HOPE, PATIENCE = 6.0, 3.5  # times the least energy: what more a move may have, e times less after so many steps
STALE = 15  # tries without less overlap, after which what overlaps weighs more: up to twice as much
WORTH = 0.75  # the energy falls to so much before the box is grown again
LAST = 0.98  # of the budget, after which any lower energy is worth that
EASILY = 0.01  # of its volume, by which the box is smaller: it is made too small and grown again at once
GROWTH, SOFT = 0.002, 0.4  # of its volume at once, times (energy / FREE) ** SOFT
TINY = 1e-300
SLACK = 1e-6  # of the volume that may be left
FREE, SURELY_FREE = 1e-6, 5e-7  # of `Relaxation.unit`: energies, by few and by all samples, that booleans may take away


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
    (none) where neither is given. settings : seed and resolution count. Ctrl-C and the time limit return the best
    so far, but for the first placement, which is made in any case.

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
        while not budget.over() and not search.full:
            search.try_placement() if rule else search.move()
    except KeyboardInterrupt:
        if search.container is None:
            raise
        search.interrupted = True
    finally:
        search.bar.close()
    return search.result()


@dataclass(frozen=True)
class _Tight:
    """Where all bodies lie in a box too small for them: rotation `(N, 3, 3)`, translation `(N, 3)`, edges `(3,)`; their
    energy, each body's share of it, and what it was when the box was last grown; the bodies' weights, and for how many
    tries nothing was better."""

    rotation: np.ndarray
    translation: np.ndarray
    edges: np.ndarray
    energy: float
    share: np.ndarray
    tried: float
    weight: np.ndarray
    stale: int = 0


class _Search:
    """A search under way: poses of all bodies that hold in `container`."""

    def __init__(self, bodies, shape, settings, device, budget, progress, rule):
        self.bodies, self.shape, self.settings = list(bodies), shape, settings
        self.device = resolve_device(device)
        self.budget = budget
        self.random = np.random.default_rng(settings.seed)
        self.volumes = np.array([body.volume for body in bodies])
        self.container: Container | None = None
        self.start: Poses | None = None
        self.tight: _Tight | None = None
        self.interrupted = False
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

    # -- in a box too small ------------------------------------------------------------------------------------------

    def move(self) -> None:
        """One try to have less overlap in a box that is too small."""
        self.budget.tries += 1
        self.bar.update()
        tight = self.tight
        if tight is None:
            tight = self._tighten(self.start.rotation.numpy(), self.start.translation.numpy(), self.container.size)
        edges, starts = self._reshaped(tight)
        rotation, translation = (np.stack(x) for x in zip(*starts, strict=True))
        ceiling = tight.energy * (1 + HOPE * np.exp(-np.arange(STEPS) / PATIENCE))
        ceiling[:FIRST_STEPS] = np.inf
        energy, rotation, translation, share = self.rough.run(
            rotation, translation, box(edges), self.gap, ceiling, tight.weight
        )
        least = int(energy.argmin())
        if energy[least] < tight.energy:
            now = rotation[least], translation[least], edges, float(energy[least]), share[least]
            tight = _Tight(*now, tight.tried, tight.weight)
        elif tight.stale == STALE:
            tight = self._weighed(tight)
        else:
            tight = replace(tight, stale=tight.stale + 1)
        late = self.budget.over(LAST)
        if tight.energy < (1.0 if late else WORTH) * tight.tried:
            tight = self._loosen(tight)
        self.tight = tight

    @cached_property
    def gap(self) -> float:
        return GAP * float(self.rough.radius.mean())

    @cached_property
    def rough(self) -> Relaxation:
        return Relaxation(self.bodies, SPACING, self.stack)

    @cached_property
    def fine(self) -> Relaxation:
        return Relaxation(self.bodies, stack=self.stack)

    @cached_property
    def stack(self) -> GridStack:
        return GridStack.of_bodies(self.bodies)

    @cached_property
    def moves(self) -> Moves:
        return Moves(self.bodies, self.random)

    def _tighten(self, rotation: np.ndarray, translation: np.ndarray, edges: np.ndarray) -> _Tight:
        """All, in a box of these edges, pressed into one too small."""
        small = self._scaled(self.container.size, 1 - OVER)
        place, forever = translation * (small / edges), np.full(STEPS, np.inf)
        energy, rotation, place, share = self.rough.run(rotation[None], place[None], box(small), self.gap, forever)
        return _Tight(rotation[0], place[0], small, float(energy[0]), share[0], np.inf, np.ones(len(self.bodies)))

    def _weighed(self, tight: _Tight) -> _Tight:
        """The same poses, what overlaps in them weighing more."""
        weight = tight.weight * (1 + tight.share / max(tight.share.max(), TINY))
        weight /= weight.mean()
        poses = tight.rotation[None], tight.translation[None]
        energy, _, _, share = self.rough.run(*poses, box(tight.edges), self.gap, np.full(1, np.inf), weight)
        scale = float(energy[0]) / max(tight.energy, TINY)
        return replace(
            tight, energy=float(energy[0]), share=share[0], tried=tight.tried * scale, weight=weight, stale=0
        )

    def _reshaped(self, tight: _Tight) -> tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
        """The edges of a try's box, and where it starts from: moves, or now and then other free edges."""
        poses, free = (tight.rotation, tight.translation), np.flatnonzero(self.shape.free)
        if self.shape.cube or len(free) < 2 or self.random.random() > RESHAPED:
            return tight.edges, [self.moves.any(*poses, tight.share) for _ in range(BATCH)]
        edges, one = tight.edges.copy(), self.random.choice(free)
        longer = np.exp(RESHAPING * self.random.standard_normal())
        edges[free] *= longer ** (-1 / (len(free) - 1))
        edges[one] *= longer ** (len(free) / (len(free) - 1))
        poses = tight.rotation, tight.translation * (edges / tight.edges)
        return edges, [poses, *(self.moves.any(*poses, tight.share) for _ in range(BATCH - 1))]

    def _loosen(self, tight: _Tight) -> _Tight:
        """Grow the box until all hold; made too small again where it is the best."""
        rotation, translation, edges, energy = tight.rotation, tight.translation, tight.edges, tight.energy
        forever = np.full(STEPS, np.inf)
        while not self.budget.spent():
            soft = max(1.0, energy / (FREE * self.rough.unit)) ** SOFT
            larger = self._scaled(edges, 1 + GROWTH * soft)
            if np.prod(larger) >= self.least:
                break
            translation, edges = translation * (larger / edges), larger
            for pressed, free in ((self.rough, FREE), (self.fine, SURELY_FREE)):
                found = pressed.run(rotation[None], translation[None], box(edges), self.gap, forever)
                energy, rotation, translation, _ = (x[0] for x in found)
                if energy > free * pressed.unit:
                    break
            else:
                start = Poses(torch.from_numpy(rotation), torch.from_numpy(translation))
                held, before = mend(self.bodies, start, box(edges), STRICT * TOLERANCE, NEARLY), self.least
                if held is not None and self._keep(*self._drawn_in(held, edges)):
                    again = self._tighten(tight.rotation, tight.translation, tight.edges)
                    return again if self.least < before * (1 - EASILY) else replace(again, tried=again.energy)
        return replace(tight, tried=tight.energy)

    def _scaled(self, edges: np.ndarray, factor: float) -> np.ndarray:
        """Edges of a box whose volume is so many times as large."""
        return np.where(self.shape.free, edges * factor ** (1 / self.shape.free.sum()), edges)

    # -- the record --------------------------------------------------------------------------------------------------

    def _drawn_in(self, start: Poses, most: np.ndarray | None = None) -> tuple[Container, Poses]:
        """The box of the shape that just holds the objects as they lie, and their poses in it; that of the edges
        `most` where it is smaller, as objects may stick out of a box by the certificate's tolerance."""
        matrices = file_to_world(self.bodies, start.rotation, start.translation)
        solids = [placed_solid(body, matrix) for body, matrix in zip(self.bodies, matrices, strict=True)]
        bounds = np.array([solid.bounding_box() for solid in solids]).reshape(-1, 2, 3)
        low, high = bounds[:, 0].min(0), bounds[:, 1].max(0)
        edges = np.array([size if e is None else e for size, e in zip(high - low, self.shape.edges, strict=True)])
        if self.shape.cube:
            edges[:] = edges.max()
        fits = edges >= high - low
        if most is not None and np.prod(most) < np.prod(edges):
            return box(most), start
        middle = np.where(self.shape.free | fits, (low + high) / 2, 0.0)
        return box(edges), Poses(start.rotation, start.translation - torch.from_numpy(middle))

    @property
    def least(self) -> float:
        """Volume of the smallest box so far, cubic metres."""
        return np.inf if self.container is None else self.container.volume

    @property
    def full(self) -> bool:
        """Nothing is left to gain."""
        return self.least <= self.volumes.sum() * (1 + SLACK)

    def _keep(self, container: Container, start: Poses) -> bool:
        """Judge a packing; kept, and True, where it holds in a smaller box than the best."""
        if container.volume >= self.least:
            return False
        matrices = file_to_world(self.bodies, start.rotation, start.translation)
        holds = certify(self.bodies, matrices, container).holds
        if holds:
            self.container, self.start = container, start
            density = float(self.volumes.sum() / container.volume)
            self.rounds.append({"tries": self.budget.tries, "box": container.size.tolist(), "density": density})
            self.bar.set_postfix_str(f"{' x '.join(f'{e:.4f}' for e in container.size)} m, density {density:.4f}")
        return holds

    def result(self) -> Packing:
        """The smallest box, certified anew."""
        everything = list(range(len(self.bodies)))
        record = (), self.rounds, self.interrupted
        return finish(self.bodies, everything, self.start, self.container, self.settings, self.device, *record)


def _longest(bodies: Sequence[Body]) -> float:
    """A length that no body exceeds, however it is turned."""
    return max((2 * body.radius for body in bodies), default=1.0)
