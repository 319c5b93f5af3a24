"""The kit's own packing: spectral placement, then objects pressed into what is left, by the same losses.

1. Spectral placement, ruined and built again for a share of the budget (`spectral`).
2. Again and again: an object of the pool goes where it overlaps least, alone or for a smaller one that is taken out;
   Eq. 4 and 5 and surface contact press all apart; contact alone takes the rest; exact booleans judge. What holds and
   is denser is kept, everything else forgotten, so that there is a certified packing at any time.

Eq. 5 acts only beyond the wall here: with the paper's epsilon of 1 cm it presses together what lies along a wall.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch

from . import losses, poses
from .arrange import arrange, file_to_world
from .certify import TOLERANCE, Certificate, certify
from .containers import Container
from .errors import InputError
from .meshes import Body
from .packing import Packing, check_sizes, finish, progress_bar
from .problem import Problem, Settings, Start
from .scene import Scene, resolve_device
from .sdf import GridStack
from .spectral import Spectral
from .voxels import Room, Turned

EFFORT = 400  # tries, where no time is given
REBUILD_SHARE = 0.2  # of the seconds
REBUILD_VOXELS = 10_000  # looked at in rebuilding for each unit of effort; above, pressing in is worth more
VOIDS = 48  # voxels along the container's longest edge, in which voids are looked for
CANDIDATES, TURNS = 4, 16  # objects and rotations looked at in each try
SWAPS = 0.7  # share of the tries that take an object out for a larger one
HOPELESS_SHARED = 0.15  # of a mean object's volume: objects that share more are not pressed in
HOPELESS_OVERLAP = 1e-4  # mean volumes times radii: Eq. 4 as a volume integral, after pressing
NEARLY = 20 * TOLERANCE  # faults that settling again may still take away
SETTLINGS = 3
RATE = 0.033  # of a mean object's radius: the first step while pressing
CLEARANCE = 6e-4  # contact margin, of the viewing width
SKIN = 3e-4  # of the viewing width: Eq. 5's epsilon


def pack(
    bodies: Sequence[Body],
    container: Container,
    settings: Settings | None = None,
    device: str | torch.device = "cpu",
    time_limit: float | None = None,
    effort: int | None = None,
    progress: bool = False,
) -> Packing:
    """The densest certified packing of some of `bodies` that is found.

    time_limit : seconds. effort : number of tries, `EFFORT` where neither is given; the same effort and seed give the
    same packing on a machine. settings : seed, resolution and query points count. Ctrl-C and the time limit return the
    best so far. Raises InputError for no bodies, bodies larger than the container, or where not one could be placed.
    """
    settings = settings or Settings()
    check_sizes(bodies, container)
    if effort is not None and effort < 0:
        raise InputError(f"effort must not be negative, got {effort}")
    if effort is None and time_limit is None:
        effort = EFFORT
    search = _Search(bodies, container, settings, device, time_limit, effort, progress)
    try:
        search.construct()
        search.press_in()
    except KeyboardInterrupt:
        if not search.chosen:
            raise
        search.interrupted = True
    finally:
        search.bar.close()
    return search.result()


class _Search:
    """A search under way: the packing that holds, as indices into the pool and poses."""

    def __init__(self, pool, container, settings, device, time_limit, effort, progress):
        self.pool, self.container, self.settings = list(pool), container, settings
        self.device = resolve_device(device)
        self.began, self.time_limit, self.effort = time.monotonic(), time_limit, effort
        self.random = np.random.default_rng(settings.seed)
        self.volumes = np.array([body.volume for body in pool]) / container.volume
        self.radius = float(np.mean([body.radius for body in pool]))
        self.cameras = container.views()
        self.width = max(camera.width for camera in self.cameras)
        self.chosen: list[int] = []
        self.start = Start(torch.zeros(0, 3, 3), torch.zeros(0, 3))
        self.history: list[np.ndarray] = []
        self.rounds: list[dict] = []
        self.tries, self.interrupted = 0, False
        self.bar = progress_bar("dense", "try", progress, effort)

    @property
    def density(self) -> float:
        return float(self.volumes[self.chosen].sum())

    def spent(self, share: float = 1.0) -> bool:
        """True where a share of the time is over."""
        return self.time_limit is not None and time.monotonic() - self.began > share * self.time_limit

    # -- construction ------------------------------------------------------------------------------------------------

    def construct(self) -> None:
        """Spectral placement, and its rebuilding."""
        spectral = Spectral(self.pool, self.container, self.settings.seed)
        spectral.fill(stop=self.spent)
        self._take(spectral)
        voxels, done = int(spectral.room.shape.prod()), 0
        if voxels > REBUILD_VOXELS:
            return
        rebuildings = np.inf if self.effort is None else self.effort * REBUILD_VOXELS // voxels
        while self.chosen and done < rebuildings and not self.spent(REBUILD_SHARE):
            spectral.rebuild(lambda: self.spent(REBUILD_SHARE))
            done += 1
            if spectral.density > self.density + 1e-9:
                self._take(spectral)

    def _take(self, spectral: Spectral) -> None:
        """Judge a placement, and keep what holds of it."""
        chosen, start = list(spectral.placed), spectral.start
        while chosen and not (certificate := self._judge(chosen, start)).holds:
            # voxels cover what touches them, so this is for what the voxeliser's rounding lets through
            names = [fault.first for fault in certificate.overlaps] + [p.body for p in certificate.protrusions]
            keep = [i for i, index in enumerate(chosen) if self.pool[index].name != names[0]]
            chosen, start = [chosen[i] for i in keep], start.take(keep)
        if self.volumes[chosen].sum() > self.density:
            self._keep(chosen, start)

    # -- pressing in -------------------------------------------------------------------------------------------------

    def press_in(self) -> None:
        """Try objects until the budget is spent."""
        self.stack = GridStack.of_bodies(self.pool, self.device)
        self.half = torch.tensor(np.array([body.half_extents for body in self.pool]), device=self.device).float()
        edge = float(np.ptp(self.container.bounds, axis=0).max())
        self.room = Room(self.container, edge / VOIDS, margin=0.0)
        while not self.spent() and (self.effort is None or self.tries < self.effort):
            if len(self.chosen) == len(self.pool):
                return
            self.tries += 1
            self.bar.update()
            proposal = self._propose()
            if proposal is None:
                continue
            settled = self._settle(*proposal)
            if settled is not None and self.volumes[settled[0]].sum() > self.density - 1e-9:
                self._keep(*settled)

    def _propose(self) -> tuple[list[int], Start] | None:
        """One more object, or a larger one for another: where it shares least with the others."""
        keep, least = list(range(len(self.chosen))), 0.0
        if keep and self.random.random() < SWAPS:
            least = self.volumes[self.chosen[keep.pop(self.random.integers(len(keep)))]]
        chosen, start = [self.chosen[i] for i in keep], self.start.take(keep)
        rest, mean = np.setdiff1d(np.arange(len(self.pool)), self.chosen), float(self.volumes.mean())
        rest = rest[(self.volumes[rest] > least * (1 + 1e-6)) & (self.volumes[rest] < least + 2 * mean)]
        self.room.clear(self._taken(chosen, start))
        found, least_shared = None, HOPELESS_SHARED * mean * self.container.volume
        for index in map(int, self.random.choice(rest, min(CANDIDATES, len(rest)), replace=False)):
            place = self.room.least_shared(self._turned(index))
            if place is not None and place[2] < least_shared:
                found, least_shared = (index, *place[:2]), place[2]
        if found is None:
            return None
        index, turned, shift = found
        rotation = torch.from_numpy(turned.rotation)[None].to(start.rotation.dtype)
        centre = torch.from_numpy(self.room.centre(turned, shift))[None].to(start.translation.dtype)
        start = Start(torch.cat([start.rotation, rotation]), torch.cat([start.translation, centre]))
        return [*chosen, index], start

    def _taken(self, chosen: list[int], start: Start) -> np.ndarray | None:
        """The room's voxels whose middle lies in an object."""
        if not chosen:
            return None
        origin = torch.tensor(self.room.origin + self.room.voxel / 2, device=self.device).float()
        lattice = losses.Lattice(origin, self.room.voxel, tuple(map(int, self.room.shape)), None)
        place = (x.to(self.device).float() for x in (start.rotation, start.translation))
        return losses.occupancy(self.stack.take(chosen), self.half[chosen], *place, lattice).cpu().numpy() > 0

    def _turned(self, index: int):
        """An object of the pool in random rotations, as voxels."""

        def inside(places: np.ndarray) -> np.ndarray:
            points = torch.from_numpy(places).to(self.device).float()
            own = torch.full((len(points),), index, device=self.device)
            return (self.stack.sample(own, points)[0] < 0).cpu().numpy()

        generator = torch.Generator().manual_seed(int(self.random.integers(2**31)))
        for rotation in poses.quaternion_to_rotation(poses.random_quaternions(TURNS, generator, torch.float64)).numpy():
            yield Turned.filling(self.half[index].cpu().numpy(), inside, rotation, self.room.voxel)

    def _settle(self, chosen: list[int], start: Start) -> tuple[list[int], Start] | None:
        """Press the objects apart until the certificate holds; None where it does not come to that."""
        bodies = [self.pool[index] for index in chosen]
        problem, scene = Problem(bodies, self.container), Scene(bodies, self.container, self.cameras, self.device)
        rate = RATE * self.radius / self.width
        press = replace(
            self.settings,
            iterations=80,
            learning_rate=rate,
            final_learning_rate=rate / 6,
            silhouette_weight=0.0,
            lambda_=3.0,
            epsilon=SKIN * self.width,
            contact_weight=1.0,
            contact_margin=CLEARANCE * self.width,
            seed=self.settings.seed + self.tries,
        )
        run = self._arrange(problem, press, start, scene)
        overlap = float(run.history[-5:, 2].mean()) * self.container.volume / press.query_points
        if overlap > HOPELESS_OVERLAP * self.volumes.mean() * self.container.volume * self.radius:
            if chosen[:-1] != self.chosen:
                return None
            # what did not go in has pushed the others: without it they lie as densely as before, but otherwise
            chosen, bodies = chosen[:-1], bodies[:-1]
            problem, scene = Problem(bodies, self.container), Scene(bodies, self.container, self.cameras, self.device)
            run = replace(run, problem=problem, rotation=run.rotation[:-1], translation=run.translation[:-1])
        settle = replace(
            press,
            iterations=60,
            learning_rate=rate / 3,
            final_learning_rate=rate / 60,
            overlap_weight=0.0,
            lambda_=0.0,
        )
        for _ in range(SETTLINGS):
            run = self._arrange(problem, settle, run.start, scene)
            if self.spent():
                return None
            certificate = certify(bodies, run.matrices, self.container, TOLERANCE)
            if certificate.holds:
                return chosen, run.start
            if max(certificate.worst_overlap, certificate.worst_protrusion) > NEARLY:
                return None
        return None

    def _arrange(self, problem: Problem, settings: Settings, start: Start, scene: Scene):
        def stop(_step) -> bool:
            return self.spent()

        run = arrange(problem, settings, start, self.device, scene=scene, callback=stop)
        if run.interrupted and not self.spent():
            raise KeyboardInterrupt
        self.history.append(run.history)
        return run

    # -- the record --------------------------------------------------------------------------------------------------

    def _judge(self, chosen: list[int], start: Start) -> Certificate:
        bodies = [self.pool[index] for index in chosen]
        return certify(bodies, file_to_world(bodies, start.rotation, start.translation), self.container, TOLERANCE)

    def _keep(self, chosen: list[int], start: Start) -> None:
        self.chosen, self.start = chosen, start
        self.rounds.append({"tries": self.tries, "objects": len(chosen), "density": self.density})
        self.bar.set_postfix_str(f"objects {len(chosen)}, density {self.density:.4f}")

    def result(self) -> Packing:
        """The best packing, certified anew."""
        record = self.history, self.rounds, self.interrupted
        return finish(self.pool, self.chosen, self.start, self.container, self.settings, self.device, *record)
