"""A room for a heap: lamps that are points, and the walls and the floor, tilted or not, on which they throw shadows.

Each lamp throws one picture. Seen from the lamp a picture on its surface is warped; what the heap must look like from
there, by the camera that stands in the lamp's place, is that picture through a homography.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

from ..geometry.cameras import PERSPECTIVE_DISTANCE, Camera
from ..util import o3d
from ..util.errors import InputError

LEVEL_SINE = 0.3  # of a surface against the horizontal, under which up in a picture is away from its lamp
GRAZING_SINE = 0.1  # at which light may fall onto a surface
NEAR = 1e-4  # of a lamp's distance: how far above a surface its light is looked for


@dataclass(frozen=True)
class Surface:
    """A plane. name : such as "wall". point, normal `(3,)` : metres, and any length; the side does not count."""

    name: str
    point: np.ndarray
    normal: np.ndarray


@dataclass(frozen=True)
class Throw:
    """A lamp's shadow. at `(3,)` : the lamp. surface : where its picture falls, with an edge of `height` metres."""

    at: np.ndarray
    surface: Surface
    height: float

    def frame(self, heap: np.ndarray) -> np.ndarray:
        """`(4, 3)`, rows: the picture's middle, right, up, as one sees it from the lamp's side, and the surface's
        normal towards it. The middle is where the lamp's ray through the heap falls."""
        normal = self.surface.normal / np.linalg.norm(self.surface.normal)
        ray = heap - self.at
        normal = -normal * np.sign(normal @ ray)
        middle = self.at + ray * ((self.surface.point - self.at) @ normal / (ray @ normal))
        up = np.array([0.0, 0.0, 1.0])
        if np.linalg.norm(np.cross(normal, up)) < LEVEL_SINE:
            up = ray * [1, 1, 0] if np.linalg.norm(ray[:2]) > 1e-6 * np.linalg.norm(ray) else np.array([0.0, 1.0, 0.0])
        up = up - (up @ normal) * normal
        up /= np.linalg.norm(up)
        return np.stack([middle, np.cross(-normal, up), up, normal])


@dataclass(frozen=True)
class Room:
    """heap `(3,)` : where the middle of the heap is, metres, z up. throws : one for each picture."""

    heap: np.ndarray
    throws: Sequence[Throw]

    def __post_init__(self):
        """Raises InputError, naming the lamp, where no shadow can fall as it should."""
        for number, throw in enumerate(self.throws, 1):
            name, ray = f"lamp {number}", self.heap - throw.at
            away, normal = float(np.linalg.norm(ray)), throw.surface.normal / np.linalg.norm(throw.surface.normal)
            surface = throw.surface.name
            if away < 1e-9:
                raise InputError(f"{name} stands inside the heap; move it away")
            if abs(ray @ normal) < GRAZING_SINE * away:
                raise InputError(f"{name} shines along the {surface}, not onto it; move it before the {surface}")
            reach = (throw.surface.point - throw.at) @ normal / (ray @ normal)
            if reach <= 0:
                raise InputError(f"the {surface} is behind {name}; the heap must stand between the two")
            if reach <= 1:
                raise InputError(f"the {surface} is between {name} and the heap; move it behind the heap")
            half = self._half_width(throw)
            if away < math.sqrt(2) * half:
                raise InputError(
                    f"{name} stands inside the heap, which is {2 * half:.2g} m wide for a shadow of "
                    f"{throw.height:g} m; move it away, or make the shadow smaller"
                )
            if 2 * half > away / PERSPECTIVE_DISTANCE:
                raise InputError(
                    f"{name} is {away:.2g} m from a heap that is {2 * half:.2g} m wide for a shadow of "
                    f"{throw.height:g} m; make the shadow smaller, or move the lamp to {PERSPECTIVE_DISTANCE:g} widths"
                )
            for other in self.throws:
                side = [(x - other.surface.point) @ other.surface.normal for x in (throw.at, self.heap)]
                if side[0] * side[1] <= 0:
                    raise InputError(f"{name} stands behind the {other.surface.name}, which is before the heap then")

    @property
    def width(self) -> float:
        """Metres: how wide the heap is to be for its largest picture."""
        return 2 * max(self._half_width(throw) for throw in self.throws)

    def _half_width(self, throw: Throw) -> float:
        """Half the edge of the square about the heap, across the lamp's ray, that holds the picture."""
        middle, right, up, _ = throw.frame(self.heap)
        ray = self.heap - throw.at
        ray /= np.linalg.norm(ray)
        away, half = np.linalg.norm(self.heap - throw.at), throw.height / 2
        corners = np.array([middle + half * (a * right + b * up) for a in (-1, 1) for b in (-1, 1)]) - throw.at
        depth = corners @ ray
        if depth.min() <= 0:
            return math.inf
        local = (corners / depth[:, None] * away) @ self._camera(throw).axes.T
        return float(np.abs(local[:, :2]).max())

    def _camera(self, throw: Throw) -> Camera:
        x, y, z = self.heap - throw.at
        elevation = -math.degrees(math.atan2(z, math.hypot(x, y)))
        azimuth = math.degrees(math.atan2(-x, y)) if math.hypot(x, y) > 1e-9 else 0.0
        away = float(np.linalg.norm(self.heap - throw.at))
        return Camera(azimuth, elevation, away / PERSPECTIVE_DISTANCE, projection="perspective")

    def cameras(self) -> list[Camera]:
        """A camera in each lamp's place, about the heap's middle as origin, metres."""
        return [self._camera(throw) for throw in self.throws]

    def corrected(self, pictures: np.ndarray) -> np.ndarray:
        """What the cameras must see, `(K, H, H)` bool, so that the pictures `(K, H, H)` bool fall on the surfaces."""
        size, found = pictures.shape[-1], []
        for throw, camera, picture in zip(self.throws, self.cameras(), pictures, strict=True):
            middle, right, up, normal = throw.frame(self.heap)
            origins, rays = camera.rays(size)
            origins = origins + self.heap
            reach = ((middle - origins) @ normal) / (rays @ normal)
            on = origins + reach[..., None] * rays - middle
            at = np.stack([0.5 - on @ up / throw.height, 0.5 + on @ right / throw.height]) * size - 0.5
            seen = map_coordinates(picture.astype(float), at, order=1, mode="constant")
            found.append((seen > 0.5) & (reach > 0))
        return np.stack(found)

    def shadows(self, vertices: np.ndarray, faces: np.ndarray, size: int) -> np.ndarray:
        """`(K, size, size)` bool: where closed surfaces, vertices `(V, 3)` metres about the heap's middle, faces
        `(F, 3)`, darken the squares of the pictures, row 0 on top; each by its own lamp alone."""
        scene, tensor = o3d.caster([(vertices, faces)]), o3d.load().core.Tensor
        steps = (np.arange(size) + 0.5) / size - 0.5
        found = []
        for throw in self.throws:
            middle, right, up, _ = throw.frame(self.heap)
            u, v = np.meshgrid(steps * throw.height, -steps * throw.height)
            points = middle + u[..., None] * right + v[..., None] * up
            rays = np.concatenate([points - self.heap, throw.at - points], -1).astype(np.float32)
            found.append(scene.test_occlusions(tensor(rays), tnear=NEAR, tfar=1.0).numpy())
        return np.stack(found)

    def to_dict(self) -> dict:
        """As a room's file has it."""
        surfaces = {throw.surface.name: throw.surface for throw in self.throws}
        return {
            "heap": self.heap.tolist(),
            "surfaces": {n: {"point": s.point.tolist(), "normal": s.normal.tolist()} for n, s in surfaces.items()},
            "lamps": [{"at": t.at.tolist(), "onto": t.surface.name, "height": t.height} for t in self.throws],
        }
