"""Baselines: objects one after the other, largest first, each in one of 24 turns where a rule puts it; what fits the
empty container in none of these is turned as its diagonals run (`slant`).

- spectral: where it lies most snugly (Cui et al. 2023, Dense, Interlocking-Free and Scalable Spectral Packing);
- dblf: deepest, then furthest back, then furthest left, holes included (Wang et al. 2010, Two natural heuristics);
- heightmap: dropped from above where it raises the surface least (Wang & Hauser 2021, Dense robotic packing).

Any of them can be ruined and built again: what lies about a random point is taken out, and the container filled anew.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import islice

import numpy as np
import torch

from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..poses import Poses
from ..problem import Settings
from ..util.budget import Budget
from ..util.errors import InputError
from ..util.progress import progress_bar
from .layout import Layout
from .pool import Worth, kind
from .result import Packing, finish
from .slant import is_long, slanted_turns
from .voxel_correlation import Room, Turned, choose_voxel, straight

RULES = {"spectral": Room.snuggest, "dblf": Room.deepest, "heightmap": Room.flattest}
SHUFFLE = 0.15  # of the order by volume, when the container is filled anew
TEMPERATURE = 0.003  # density that a rebuilding may lose now and then
FEW_VOXELS = 10_000  # of a room in which placing again and again costs little
MOST_RUINED_FRACTION = 0.5  # of the objects, taken out at once
MOST_SLANTED = 8  # turns of what fits at a slant alone: covering each with voxels takes long


def pack(
    bodies: Sequence[Body],
    container: Container,
    settings: Settings | None = None,
    device: str | torch.device = "cpu",
    time_limit: float | None = None,
    progress: bool = False,
    rule: str = "spectral",
    sequences: int = 1,
    shuffle: float = SHUFFLE,
) -> Packing:
    """One placement, the largest first; or the best of more, in shaken orders.

    rule : one of RULES. sequences : orders tried. shuffle : spread of the logarithm by which the volumes' order is
    shaken, infinite for random orders, the first included. time_limit : seconds; if given, as many as it allows.
    settings : seed and resolution count. bodies : as `dense.pack` has them. Raises InputError for an unknown rule, or
    if not one could be placed.
    """
    settings = settings or Settings()
    if rule not in RULES:
        raise InputError(f"rule {rule!r} is unknown; use one of {', '.join(RULES)}")
    budget = Budget(time_limit)
    placement, best, rounds = Placement(bodies, container, settings.seed, rule), {}, []
    with progress_bar(rule, "placement", progress) as bar:
        while not rounds or (len(rounds) < sequences if time_limit is None else not budget.spent()):
            placement.placed = {}
            placement.fill(placement.shaken(shuffle) if rounds or np.isinf(shuffle) else None, budget.spent)
            if placement.worth.more(placement.placed, best):
                best = placement.placed
            rounds.append({"objects": len(placement.placed), "density": placement.density})
            bar.update()
            bar.set_postfix_str(f"density {placement.density_of(best):.4f}")
    placement.placed = best
    return finish(bodies, list(best), placement.poses, container, settings, device, rounds=rounds)


class Placement:
    """A placement under way.

    straight : quarter turns alone; in a container whose size is sought, nothing need lie at a slant.
    placed : index in the pool -> turn and shift, in the order of placing.
    """

    def __init__(
        self,
        pool: Sequence[Body],
        container: Container,
        seed: int = 0,
        rule: str = "spectral",
        straight: bool = False,
    ):
        self.rule, self.straight = RULES[rule], straight
        self.pool, self.container = pool, container
        self.worth = Worth(pool)
        self.volumes = self.worth.volumes
        self.room = Room(container, choose_voxel(pool, container))
        self.random = np.random.default_rng(seed)
        self.turns: dict[tuple, list[Turned]] = {}
        self.slanted: dict[tuple, list[Turned]] = {}
        self.placed: dict[int, tuple[Turned, np.ndarray]] = {}

    def enter(self, container: Container, keep: bool = False, voxel: float | None = None) -> None:
        """Go on in another container; with `keep`, what is placed stays as far from its lowest corner as it was.

        voxel : edge of its voxels in metres, as before if None; where it changes, nothing can be kept.
        """
        before = self.room.voxel
        self.container, self.room = container, Room(container, before if voxel is None else voxel)
        if self.room.voxel != before:
            self.turns, self.slanted = {}, {}
        if not keep:
            self.placed = {}

    @property
    def coarse(self) -> bool:
        """The room has few voxels: the objects are made of large equal cubes."""
        return bool(self.room.shape.prod() <= FEW_VOXELS)

    @property
    def cubes(self) -> float | None:
        """Edge in metres of the equal cubes of which all objects are made; None if they are not."""
        return self.room.voxel if self.coarse else None

    @property
    def density(self) -> float:
        """Eq. 6, of what is placed."""
        return self.density_of(self.placed)

    def density_of(self, chosen: Iterable[int]) -> float:
        """Eq. 6, of these of the pool."""
        return self.worth.volume(chosen) / self.container.whole.volume

    @property
    def layout(self) -> Layout:
        """What is placed, in the order of placing."""
        return Layout(list(self.placed), self.poses)

    @property
    def poses(self) -> Poses:
        """The poses of what is placed, in the order of placing."""
        turns = np.array([turned.rotation for turned, _ in self.placed.values()]).reshape(-1, 3, 3)
        centres = np.array([self.room.centre(turned, shift) for turned, shift in self.placed.values()]).reshape(-1, 3)
        return Poses(torch.from_numpy(turns), torch.from_numpy(centres))

    def shaken(self, shuffle: float = SHUFFLE) -> np.ndarray:
        """`(N,)` pool indices: the largest first, but for some chance; by chance alone if `shuffle` is infinite."""
        chance = self.random.standard_normal(len(self.volumes))
        order = np.argsort(chance if np.isinf(shuffle) else -self.volumes * np.exp(shuffle * chance))
        return self.worth.first(order)

    def fill(self, order: Sequence[int] | None = None, stop: Callable[[], bool] = lambda: False) -> None:
        """Place what fits, in the given order of pool indices; the largest first if None."""
        order = self.worth.first(np.argsort(-self.volumes, kind="stable")) if order is None else order
        self.room.clear()
        for turned, shift in self.placed.values():
            self.room.place(turned, shift)
        free = (~self.room.taken).sum() * self.room.voxel**3 * (1 + 1e-6)
        refused: set[tuple] = set()
        for index in map(int, order):
            body = self.pool[index]
            if index in self.placed or kind(body) in refused or body.volume > free:
                continue
            if stop():
                return
            found = self.rule(self.room, self._turns(body))
            if found is None and not self.straight:
                found = self.rule(self.room, self._slanted(body))
            if found is None:
                refused.add(kind(body))
                continue
            turned, shift = found
            self.room.place(turned, shift)
            self.placed[index] = turned, shift
            free -= body.volume

    def rebuild(self, stop: Callable[[], bool] = lambda: False) -> None:
        """Take out what lies about a random point and fill anew in a shaken order; kept if it loses nothing, or by
        chance little."""
        before, density = dict(self.placed), self.density
        spot = self.random.random(3) * self.room.shape
        away = {
            index: np.linalg.norm(shift + np.array(turned.voxels.shape) / 2 - spot)
            for index, (turned, shift) in before.items()
        }
        most = max(3, int(MOST_RUINED_FRACTION * len(before)))
        ruined = sorted(away, key=away.get)[: self.random.integers(2, most)]
        self.placed = {index: pose for index, pose in before.items() if index not in ruined}
        self.fill(self.shaken(), stop)
        lost = self.random.random() > np.exp((self.density - density) / TEMPERATURE)
        if lost or stop() or self.worth.compared(self.placed, before) < 0:
            self.placed = before

    def _turns(self, body: Body) -> list[Turned]:
        """The body's distinct quarter turns."""
        if kind(body) not in self.turns:
            found: list[Turned] = []
            for turned in straight(body, self.room.voxel, Turned.covering):
                if not any(np.array_equal(turned.voxels, other.voxels) for other in found):
                    found.append(turned)
            self.turns[kind(body)] = found
        return self.turns[kind(body)]

    def _slanted(self, body: Body) -> list[Turned]:
        """A long body as the container's diagonals run, a few turns that fit the empty container; none if a quarter
        turn does."""
        if kind(body) not in self.slanted:
            self.slanted[kind(body)] = found = []
            empty = Room(self.container, self.room.voxel)
            if body.wishes.turns is None and is_long(body, self.container) and not empty.holds(self._turns(body)):
                turns = (Turned.covering(body, turn, empty.voxel) for turn in slanted_turns(body, self.container))
                found += islice((turned for turned in turns if empty.holds([turned])), MOST_SLANTED)
        return self.slanted[kind(body)]
