"""What the loop is given: a problem, and settings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from . import losses, query_points
from .geometry.cameras import Camera
from .geometry.containers import MARGIN, Container
from .geometry.meshes import Body
from .scene import Scene
from .util.errors import InputError

ROTATIONS = ("angles", "quaternion")
# what Eq. 2 compares, and into how many layers it parts the viewing volume (`kernels.slices`)
SHADOWS = {"silhouette": 0, "thickness": 1, "slices": 8}
SLICE_PIXEL = 2  # how wide a pixel of a slice is, in those of a silhouette: the points in it are as far apart


@dataclass(frozen=True)
class Weighting:
    """How Eq. 1 weighs its terms: a reading of the paper's text, or of its authors' code.

    source : where it comes from. silhouette, overlap, extrusion : what Eq. 2, 4 and 5 are over pixels and views, query
    points, and vertices, "sum" or "mean". unit : of the lengths in Eq. 4 and 5, "metre" or "step", the spacing of the
    query points. factors : on Eq. 2, on Eq. 4, and on lambda.
    """

    source: str
    silhouette: str = "mean"
    overlap: str = "sum"
    extrusion: str = "sum"
    unit: str = "metre"
    factors: tuple[float, float, float] = (1.0, 1.0, 1.0)


WEIGHTINGS = {
    "printed": Weighting("the paper's Eq. 1, 2, 4 and 5 as printed, lengths in metres"),
    "overlap_mean": Weighting("Eq. 4 as a mean over the query points, as Eq. 2 is over pixels", overlap="mean"),
    "means": Weighting("Eq. 4 and 5 as means, as Eq. 2 is", overlap="mean", extrusion="mean"),
    "pixel_sum": Weighting("Eq. 2 summed over pixels and views, as the authors' code does", silhouette="sum"),
    "summed": Weighting(
        "the same, and lengths in steps of the query points, the unit of the authors' code",
        silhouette="sum",
        unit="step",
    ),
    "authors": Weighting(
        "the weights of the authors' code, whose loop sets the container's to 0; it counts near points for Eq. 4",
        silhouette="sum",
        unit="step",
        factors=(0.5, 0.1, 0.0),
    ),
    "walls": Weighting("this kit's former one: as printed, but lambda 3000 times as large", factors=(1, 1, 3000)),
    "no_shadows": Weighting("overlap and walls alone, lambda a thousand times as large", factors=(0, 1, 1000)),
}


@dataclass(frozen=True)
class Settings:
    """How to optimise. The defaults are the paper's where it gives them.

    iterations, learning_rate, final_learning_rate : Adam, the rate falling geometrically; for translations it is
        in units of the viewing width, for rotations in radians.
    weighting : a name in WEIGHTINGS: what the terms of Eq. 1 are sums or means over. The weights below multiply it.
    lambda_, epsilon : weight and depth (metres) of the extrusion term (Eq. 1, 5).
    silhouette_weight, overlap_weight, contact_weight : of Eq. 2, Eq. 4 and the kit's surface contact, which the
        paper does not have (0). Contact is divided by the volume of a query point, which gives it Eq. 4's unit.
    shadow : a name in SHADOWS: what Eq. 2 compares. "silhouette" is the paper's; "thickness" and "slices" are the kit's
        extensions, for the container's own shadows.
    viewing_volume : its edge, over the largest distance that the container spans in it, where the targets are the
        container's own silhouettes. What lies beyond it casts no shadow, and no shadow pulls it back.
    contact_margin : metres that a body keeps from walls and, twice, from others, under the contact term.
    overlap_term : "shared" or "as_printed", see `losses.overlap`.
    query_points, jitter : how many, and whether the lattice is shifted at random at every iteration, so that no
        overlap hides between its points (the paper's points are fixed).
    query_volume : edge of the box of query points, over the container's. 1: they lie within the walls, as the paper's
        do, and what overlaps outside is not seen; above 1 they are as close, and more.
    resolution : pixels along an image's edge.
    softness_px, final_softness_px : blur of the silhouettes' difference, falling geometrically, for a 256 pixel image.
    rotation : "angles" (three angles -> quaternion -> rotation, the paper's) or "quaternion".
    """

    iterations: int = 1000
    learning_rate: float = 1e-2
    final_learning_rate: float = 1e-4
    weighting: str = "summed"
    lambda_: float = losses.LAMBDA
    epsilon: float = losses.EPSILON
    silhouette_weight: float = 1.0
    overlap_weight: float = 1.0
    contact_weight: float = 0.0
    contact_margin: float = 0.0
    shadow: str = "silhouette"
    viewing_volume: float = 2.0
    overlap_term: str = "shared"
    query_points: int = query_points.QUERY_POINTS
    jitter: bool = True
    query_volume: float = 1.0
    resolution: int = 256
    softness_px: float = 8.0
    final_softness_px: float = 1.0
    rotation: str = "angles"
    seed: int = 0

    def __post_init__(self):
        for name in ("iterations", "query_points", "resolution", "learning_rate", "final_learning_rate"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name} must be positive, got {getattr(self, name)}")
        for name in ("lambda_", "silhouette_weight", "overlap_weight", "contact_weight", "softness_px"):
            if not getattr(self, name) >= 0:
                raise InputError(f"{name} must not be negative, got {getattr(self, name)}")
        if not self.viewing_volume >= 1:
            raise InputError(f"viewing_volume must be at least 1, the container's own, got {self.viewing_volume}")
        if not self.query_volume >= 1:
            raise InputError(f"query_volume must be at least 1, the container's own, got {self.query_volume}")
        if self.weighting not in WEIGHTINGS:
            raise InputError(f"weighting {self.weighting!r} is unknown; use one of {', '.join(WEIGHTINGS)}")
        if self.shadow not in SHADOWS:
            raise InputError(f"shadow {self.shadow!r} is unknown; use one of {', '.join(SHADOWS)}")
        if self.rotation not in ROTATIONS:
            raise InputError(f"rotation {self.rotation!r} is unknown; use one of {', '.join(ROTATIONS)}")
        if self.overlap_term not in losses.OVERLAP_TERMS:
            raise InputError(f"overlap_term {self.overlap_term!r} is unknown; use {' or '.join(losses.OVERLAP_TERMS)}")

    def rate(self, iteration: int) -> float:
        """Adam's step at an iteration."""
        return _fall(self.learning_rate, self.final_learning_rate, iteration / self.iterations)

    def softness(self, iteration: int) -> float:
        """The blur at an iteration, in pixels of `resolution`; 0 where `softness_px` is 0."""
        if self.softness_px == 0:
            return 0.0
        fallen = _fall(self.softness_px, max(self.final_softness_px, 1e-3), iteration / self.iterations)
        return fallen * self.resolution / 256


@dataclass(frozen=True)
class Problem:
    """What to arrange: bodies in a container before cameras, with targets `(K, H, W)` in [0, 1], row 0 on top.

    cameras None: the container's own views; targets None: the container's own silhouettes. obstacles : the last so
    many bodies stay where they start, and the others are pressed against them.
    """

    bodies: Sequence[Body]
    container: Container
    cameras: Sequence[Camera] | None = None
    targets: np.ndarray | None = None
    obstacles: int = 0

    @property
    def shows_the_container(self) -> bool:
        """Whether views and targets are the container's own."""
        return self.cameras is None and self.targets is None

    def scene(
        self,
        device: str | torch.device = "cpu",
        dtype: torch.dtype = torch.float32,
        viewing_volume: float = MARGIN,
        stray: float = 0.0,
    ) -> Scene:
        """The problem's tensors on a device; viewing_volume : as in `Settings`; stray : as in `Scene`."""
        wide = viewing_volume if self.shows_the_container else MARGIN
        cameras = self.cameras or self.container.views(wide)
        return Scene(self.bodies, self.container, cameras, device, dtype, self.obstacles, stray=stray)

    def target_images(self, scene: Scene, resolution: int, shadow: str = "silhouette") -> Tensor:
        """What a shadow in SHADOWS is compared with, on the scene's device: silhouettes `(K, H, W)`, or slices
        `(K * layers, slice_resolution, slice_resolution)`.

        Raises InputError for a shape that does not fit the views, and for slices where targets are given.
        """
        if self.targets is None:
            layers = SHADOWS[shadow]
            if layers:
                return scene.container_slices(slice_resolution(resolution), layers)
            return scene.container_silhouettes(resolution)
        if shadow != "silhouette":
            raise InputError(f"targets are silhouettes, so the shadow {shadow!r} cannot be compared with them")
        targets = torch.as_tensor(np.asarray(self.targets), device=scene.device, dtype=scene.dtype)
        if targets.shape != (len(scene.cameras), resolution, resolution):
            raise InputError(
                f"targets have shape {tuple(targets.shape)}; {len(scene.cameras)} views of {resolution} x {resolution} "
                "pixels are needed"
            )
        return targets


def slice_resolution(resolution: int) -> int:
    """Pixels along a slice, where a silhouette has `resolution`."""
    return max(1, resolution // SLICE_PIXEL)


def _fall(first: float, last: float, fraction: float) -> float:
    """From `first` to `last`, geometrically."""
    return first * (last / first) ** fraction
