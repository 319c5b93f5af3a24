"""Overlapping objects pressed apart until exact booleans find nothing, with shadows that guide them or without.

Eq. 4 and 5 and surface contact press; contact alone takes the rest; exact booleans judge. Eq. 5 acts only beyond the
wall here: with the paper's epsilon of 1 cm it presses together what lies along a wall.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np
import torch

from ..exact.overlap_removal import REPAIR_TOLERANCE, REPAIRABLE_FRACTION, remove_overlaps
from ..geometry.cameras import Camera
from ..geometry.containers import MARGIN, Container
from ..geometry.meshes import Body
from ..geometry.sdf import GridStack
from ..iteration import Step, init
from ..optimizer import run
from ..poses import Poses, snapped
from ..problem import Problem, Settings
from ..scene import Scene
from .layout import Layout


@dataclass(frozen=True)
class SeparationTuning:
    """What pressing apart was tuned to."""

    pressing_iterations: int = 80
    pressing_step_of_mean_radius: float = 0.033  # the first one; it falls to a sixth
    wall_weight: float = 3.0  # of Eq. 5, per metre
    hopeless_overlap: float = 1e-4  # mean volumes times mean radii: Eq. 4 as a volume integral, after pressing
    checked_iterations: tuple[int, ...] = (15, 25, 40)  # after which pressing may be given up
    successes_remembered: int = 8  # the largest overlap that one of them had on its way bounds what is pressed on
    overlap_over_successes: float = 1.5  # times that overlap
    settling_iterations: int = 60
    settlings: int = 2  # of what contact has not quite freed, the second helps half
    most_query_points: int = 30_000  # contact sees what lies between them
    most_pixels: int = 128  # along a silhouette; fewer, as there are fewer points, keep the balance of their sums
    obstacles_within_mean_radii: float = 0.5  # how far about the movers' boxes the others are looked at
    unseen_pixels: int = 8  # along a silhouette, where shadows do not guide
    outlines_stray_px: float = 0.05  # where they guide: fine meshes are drawn with fewer triangles
    pressing_shadow_fraction: float = 0.1  # of their weight; with all of it thin objects are pressed into each other
    settling_shadow_fraction: float = 0.005  # while contact alone takes the rest
    softness_px: float = 2.0  # of shadows at first, for a 256 pixel image
    contact_margin_of_width: float = 6e-4  # of the viewing width
    wall_depth_of_width: float = 3e-4  # Eq. 5's epsilon


TUNING = SeparationTuning()


@dataclass(frozen=True)
class Pressed:
    """What pressing left: the overlap, the integral of its depth over space in metres to the fourth, and what it was
    after each of the checked iterations that were reached."""

    layout: Layout
    overlap: float
    overlap_after: dict[int, float]


class Separation:
    """Presses the objects of layouts of one pool apart in one container.

    settings : the seed, the number of query points and how rotations are parametrised count, the rest is set here.
    spent : says when time is over; pressing then ends, and nothing counts as settled. stack : the pool's grids, if they
    are at hand. shadows : silhouettes guide, too, by the settings' weights, in their viewing volume; all objects are
    then drawn. history, pulls : losses `(I, 5)`, and `(J, 4)` how hard each term pulls, of every run of the optimiser.

    Successes are remembered: once there are enough, what overlaps much more on its way than they did is given up.
    """

    def __init__(
        self,
        pool: Sequence[Body],
        container: Container,
        settings: Settings,
        device: torch.device,
        spent: Callable[[], bool],
        stack: GridStack | None = None,
        shadows: bool = False,
    ):
        self.pool, self.container, self.spent = list(pool), container, spent
        self.settings = _guided(settings) if shadows else _unguided(settings)
        self.device, self.stack, self.shadows = device, stack or GridStack.of_bodies(pool, device), shadows
        self.radius = float(np.mean([body.radius for body in pool]))
        mean_volume = float(np.mean([body.volume for body in pool]))
        self.hopeless_overlap = TUNING.hopeless_overlap * mean_volume * self.radius
        self.half = torch.tensor(np.array([body.half_extents for body in pool])).float()
        cameras = container.views(self.settings.viewing_volume)
        self.width = max(camera.width for camera in cameras)
        self.stray = TUNING.outlines_stray_px * self.width / self.settings.resolution if shadows else 0.0
        # the last scene serves again, as settling follows pressing with the same objects
        self._scene = lru_cache(maxsize=1)(
            partial(_scene, self.pool, container, cameras, device, self.stack, self.stray)
        )
        self.history: list[np.ndarray] = []
        self.pulls: list[np.ndarray] = []
        self.successes: deque[dict[int, float]] = deque(maxlen=TUNING.successes_remembered)

    def separate(
        self, layout: Layout, seed: int, movers: Sequence[int] | None = None, patient: bool = False
    ) -> Layout | None:
        """Press the movers apart and settle them; None if they do not come to hold.

        movers : positions in `layout.chosen` of the objects that may move; all if None. patient : settle them even if
        they still overlap so much that it looks hopeless.
        """
        pressed = self.press(layout, seed, movers)
        if not (patient or pressed.overlap <= self.hopeless_overlap):
            return None
        settled = self.settle(pressed.layout, seed, movers)
        if settled is not None and len(pressed.overlap_after) == len(TUNING.checked_iterations):
            self.successes.append(pressed.overlap_after)
        return settled

    def press(self, layout: Layout, seed: int, movers: Sequence[int] | None = None) -> Pressed:
        """Press the movers apart, by Eq. 4 and 5 and contact; movers : as `separate` has them."""
        contact = self._contact_settings(seed)
        rate = 3 * contact.learning_rate
        settings = replace(
            contact,
            overlap_weight=1.0,
            lambda_=self.settings.lambda_,
            iterations=TUNING.pressing_iterations,
            silhouette_weight=TUNING.pressing_shadow_fraction * self.settings.silhouette_weight,
            learning_rate=rate,
            final_learning_rate=rate / 6,
        )
        point_volume, recent = self.container.volume / settings.query_points, deque(maxlen=5)
        overlap_after: dict[int, float] = {}

        def hopeless(step: Step) -> bool:
            recent.append(step.losses[2].item())
            if step.iteration not in TUNING.checked_iterations:
                return False
            overlap_after[step.iteration] = overlap = sum(recent) / len(recent) * point_volume
            if len(self.successes) < TUNING.successes_remembered:
                return False
            most = max(success[step.iteration] for success in self.successes)
            return overlap > max(self.hopeless_overlap, TUNING.overlap_over_successes * most)

        layout = self._optimized(layout, settings, movers, hopeless)
        return Pressed(layout, sum(recent) / max(1, len(recent)) * point_volume, overlap_after)

    def settle(self, layout: Layout, seed: int, movers: Sequence[int] | None = None) -> Layout | None:
        """Take the last thin overlaps away, by contact alone, then by exact booleans; None if they do not go.

        movers : as `separate` has them.
        """
        bodies = layout.bodies(self.pool)
        for again in range(TUNING.settlings):
            layout = self._optimized(layout, self._contact_settings(seed + again), movers)
            if self.spent():
                return None
            poses = remove_overlaps(
                bodies, layout.poses, self.container, REPAIR_TOLERANCE, largest=REPAIRABLE_FRACTION, movers=movers
            )
            if poses is not None:
                return Layout(layout.chosen, poses)
        return None

    def _contact_settings(self, seed: int) -> Settings:
        """Contact alone, by small steps."""
        rate = TUNING.pressing_step_of_mean_radius / 3 * self.radius / self.width
        return replace(
            self.settings,
            iterations=TUNING.settling_iterations,
            learning_rate=rate,
            final_learning_rate=rate / 20,
            overlap_weight=0.0,
            lambda_=0.0,
            epsilon=TUNING.wall_depth_of_width * self.width,
            contact_weight=1.0,
            contact_margin=TUNING.contact_margin_of_width * self.width,
            seed=seed,
            silhouette_weight=TUNING.settling_shadow_fraction * self.settings.silhouette_weight,
        )

    def _optimized(
        self,
        layout: Layout,
        settings: Settings,
        movers: Sequence[int] | None,
        ends: Callable[[Step], bool] | None = None,
    ) -> Layout:
        """Optimise the movers among those that they may come to meet; ends : ends the run early."""
        movers = range(len(layout)) if movers is None else movers
        seen = [*movers, *self._obstacles(layout, movers)]
        obstacles, part = len(seen) - len(movers), layout.take(seen)
        ended = False

        def after(step: Step) -> bool:
            nonlocal ended
            ended = self.spent() or (ends is not None and ends(step))
            return ended

        problem = Problem(part.bodies(self.pool), self.container, obstacles=obstacles)
        state = init(problem, settings, part.poses, self._scene(tuple(part.chosen), obstacles))
        if run(state, after) and not ended:
            raise KeyboardInterrupt
        self.history.append(state.losses())
        self.pulls.append(state.pulled())
        rotation, translation = layout.poses.rotation.double().clone(), layout.poses.translation.double().clone()
        found = state.poses()
        rotation[seen] = snapped(part.bodies(self.pool), found.rotation.double().cpu())
        translation[seen] = found.translation.double().cpu()
        return Layout(layout.chosen, Poses(rotation, translation))

    def _obstacles(self, layout: Layout, movers: Sequence[int]) -> list[int]:
        """Positions of the other objects whose boxes lie near a mover's."""
        rest = np.setdiff1d(np.arange(len(layout)), movers)
        if self.shadows:  # what is hidden depends on all of them
            return rest.tolist()
        half = self.half[layout.chosen].double()
        reach = (layout.poses.rotation.double().abs() @ half[:, :, None])[:, :, 0].numpy()
        reach = reach + TUNING.obstacles_within_mean_radii * self.radius / 2
        centre = layout.poses.translation.double().numpy()
        apart = np.abs(centre[rest][:, None] - centre[movers][None]) > reach[rest][:, None] + reach[movers][None]
        return rest[(~apart.any(-1)).any(1)].tolist()


def _guided(settings: Settings) -> Settings:
    """The settings with shadows that guide."""
    return replace(
        settings,
        resolution=min(TUNING.most_pixels, settings.resolution),
        query_points=min(TUNING.most_query_points, settings.query_points),
        softness_px=TUNING.softness_px,
        final_softness_px=TUNING.softness_px / 2,
    )


def _unguided(settings: Settings) -> Settings:
    """The settings with overlap, walls and contact alone, in metres."""
    return replace(
        _guided(settings),
        weighting="printed",
        shadow="silhouette",
        silhouette_weight=0.0,
        lambda_=TUNING.wall_weight,
        resolution=TUNING.unseen_pixels,
        viewing_volume=MARGIN,
    )


def _scene(
    pool: Sequence[Body],
    container: Container,
    cameras: Sequence[Camera],
    device: torch.device,
    stack: GridStack,
    stray: float,
    chosen: tuple[int, ...],
    obstacles: int,
) -> Scene:
    """The tensors of some of the pool's objects, the last `obstacles` of which stay where they are."""
    bodies = [pool[index] for index in chosen]
    return Scene(bodies, container, cameras, device, obstacles=obstacles, stack=stack.take(list(chosen)), stray=stray)
