"""Pictures of a dark room with lamps that cast real shadows, by rays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix

from ..geometry.cameras import Camera
from ..util import o3d

SHARP_DEG = 35.0  # edges with a larger angle are drawn sharp
SAMPLES = 2  # rays along a pixel's edge
DARK = 0.03  # what light there is without lamps
FILL = 0.3  # light from where one looks, that casts no shadow, on bodies alone
FULL = 0.8  # of the brightest that can be shown: above it brightness is pressed together
NEAR = 1e-4  # of the scene's size: how far a ray to a lamp begins above the surface


@dataclass(frozen=True)
class Surface:
    """A surface in the world: vertices `(V, 3)`, faces `(F, 3)`, colour RGB in [0, 1].

    body : is lit from where one looks, too. glow : is of its own colour whatever the light, and casts no shadow.
    """

    vertices: np.ndarray
    faces: np.ndarray
    colour: Sequence[float]
    body: bool = True
    glow: bool = False


@dataclass(frozen=True)
class Lamp:
    """Parallel light along a view, through its square; so what lies in it casts that view's silhouette.

    colour : of the light, RGB, times its strength. soft : of the view's width, over which the beam fades at its rim.
    blur_deg : by which its rays differ in direction, so that shadows are softer the farther they fall.
    """

    view: Camera
    colour: Sequence[float] = (1.0, 0.92, 0.78)
    soft: float = 0.12
    blur_deg: float = 0.15

    def light(self, points: np.ndarray) -> np.ndarray:
        """What of the beam reaches points `(P, 3)` if nothing is before them, `(P,)` in [0, 1]."""
        right, up, _ = self.view.axes @ (points - np.asarray(self.view.centre)).T / (self.view.width / 2)
        rim = (right**8 + up**8) ** (1 / 8)  # a square with round corners
        return np.clip((1 - rim) / (2 * self.soft) + 1, 0, 1)

    def towards(self, points: np.ndarray) -> np.ndarray:
        """`(P, 3)`: unit vectors from points `(P, 3)` to the light."""
        return np.broadcast_to(-self.view.axes[2], points.shape)

    def away(self, points: np.ndarray) -> None:
        """How far the light is: at infinity."""

    @property
    def across(self) -> np.ndarray:
        """`(2, 3)`: unit vectors across the light."""
        return self.view.axes[:2]


@dataclass(frozen=True)
class Bulb:
    """A lamp that is a point. at `(3,)`; towards_point `(3,)` : where its cone points; half_deg : of the cone, at whose
    rim the light fades; colour, blur_deg : as a lamp's, at the cone's middle."""

    at: Sequence[float]
    towards_point: Sequence[float]
    half_deg: float
    colour: Sequence[float] = (1.0, 0.92, 0.78)
    blur_deg: float = 0.15

    def light(self, points: np.ndarray) -> np.ndarray:
        """What of the cone's light reaches points `(P, 3)` if nothing is before them, `(P,)` in [0, 1]."""
        axis = np.asarray(self.towards_point, float) - self.at
        angle = np.degrees(np.arccos(np.clip(-self.towards(points) @ axis / np.linalg.norm(axis), -1, 1)))
        return np.clip((self.half_deg - angle) / (0.1 * self.half_deg), 0, 1)

    def towards(self, points: np.ndarray) -> np.ndarray:
        """`(P, 3)`: unit vectors from points `(P, 3)` to the light."""
        return (np.asarray(self.at) - points) / self.away(points)[:, None]

    def away(self, points: np.ndarray) -> np.ndarray:
        """`(P,)`: how far the light is."""
        return np.linalg.norm(np.asarray(self.at) - points, axis=1)

    @property
    def across(self) -> np.ndarray:
        """`(2, 3)`: unit vectors across the cone's axis."""
        return np.linalg.svd((np.asarray(self.towards_point, float) - self.at)[None])[2][1:]


def picture(
    surfaces: Sequence[Surface],
    lamps: Sequence[Lamp | Bulb],
    azimuth_deg: float,
    elevation_deg: float,
    size: int = 1200,
    spread_deg: float = 24.0,
    frame: np.ndarray | None = None,
    dark: float = DARK,
) -> np.ndarray:
    """An RGB image `(H, W, 3)` uint8, its longer side of `size` pixels.

    azimuth_deg, elevation_deg : of looking, as in `cameras`. spread_deg : the angle that the picture spans. frame :
    points `(P, 3)` that the picture just holds, all surfaces if None. dark : what light there is without lamps.
    """
    tensor = o3d.load().core.Tensor
    vertices = np.concatenate([surface.vertices for surface in surfaces]).astype(np.float64)
    offsets = np.cumsum([0, *(len(surface.vertices) for surface in surfaces)])
    faces = np.concatenate([np.asarray(s.faces, np.int64) + o for s, o in zip(surfaces, offsets, strict=False)])
    counts = [len(surface.faces) for surface in surfaces]
    colours = np.repeat([np.asarray(s.colour, float)[:3] ** 2.2 for s in surfaces], counts, axis=0)
    fill = FILL * np.repeat([s.body for s in surfaces], counts)
    glow = np.repeat([s.glow for s in surfaces], counts)
    normals = _corner_normals(vertices, faces)
    clear = NEAR * float(np.linalg.norm(np.ptp(vertices, axis=0)))

    scene, shade = o3d.caster([(vertices, faces)]), o3d.caster([(vertices, faces[~glow])])
    eye, directions, (high, wide) = _sight(
        vertices if frame is None else frame, azimuth_deg, elevation_deg, size, spread_deg
    )
    rays = np.concatenate([np.broadcast_to(eye, directions.shape), directions], -1).astype(np.float32)
    hit = scene.cast_rays(tensor(rays))
    found = np.isfinite(hit["t_hit"].numpy())
    face, uv = hit["primitive_ids"].numpy()[found], hit["primitive_uvs"].numpy()[found]
    at, along = eye + directions[found] * hit["t_hit"].numpy()[found, None], directions[found]
    normal = np.einsum("pk,pkc->pc", np.column_stack([1 - uv.sum(1), uv]), normals[face])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-12
    flat = np.cross(*(vertices[faces[face, k]] - vertices[faces[face, 0]] for k in (1, 2)))
    flat /= np.linalg.norm(flat, axis=1, keepdims=True) + 1e-300
    flat *= -np.sign(np.einsum("pc,pc->p", flat, along))[:, None]
    normal *= np.sign(np.einsum("pc,pc->p", normal, flat))[:, None]
    light = dark + (fill[face] * np.abs(np.einsum("pc,pc->p", normal, along)))[:, None] * np.ones(3)
    draw = np.random.default_rng(0)
    for lamp in lamps:
        to_lamp = lamp.towards(at)
        facing = (normal * to_lamp).sum(1) * ((flat * to_lamp).sum(1) > 1e-6)
        lit = np.flatnonzero(facing > 1e-3)
        facing[lit] *= lamp.light(at[lit])
        lit = lit[facing[lit] > 1e-3]
        turn = np.tan(np.radians(lamp.blur_deg)) * draw.normal(size=(len(lit), 2))
        right, up = lamp.across
        towards, far = to_lamp[lit] + turn[:, :1] * right + turn[:, 1:] * up, lamp.away(at[lit])
        if far is not None:  # rays end at the lamp
            towards = towards * far[:, None]
        rays = np.concatenate([at[lit] + clear * flat[lit], towards], 1).astype(np.float32)
        free = ~shade.test_occlusions(tensor(rays), tfar=np.inf if far is None else 1.0).numpy()
        light[lit] += (facing[lit] * free)[:, None] * np.asarray(lamp.colour)
    shown = np.zeros((len(directions), 3))
    shown[found] = np.where(glow[face][:, None], colours[face], colours[face] * light)
    shown = shown.reshape(high, SAMPLES, wide, SAMPLES, 3).mean((1, 3))
    most = shown.max(-1, keepdims=True)  # what is too bright keeps its hue
    shown *= np.where(most > FULL, FULL + (1 - FULL) * np.tanh((most - FULL) / (1 - FULL)), most) / (most + 1e-12)
    return np.uint8(np.round(255 * shown.clip(0, 1) ** (1 / 2.2)))


def _sight(points: np.ndarray, azimuth_deg: float, elevation_deg: float, size: int, spread_deg: float):
    """The eye `(3,)`, directions `(R, 3)` of the rays, row by row, and the picture's height and width in pixels."""
    axes = Camera(azimuth_deg, elevation_deg, 1.0).axes
    local = (np.asarray(points, float) - np.mean(points, axis=0)) @ axes.T
    away = np.linalg.norm(np.ptp(local, axis=0)[:2]) / 2 / np.tan(np.radians(spread_deg) / 2)
    low, high = (f(local[:, :2] / (local[:, 2:] + away), 0) for f in (np.min, np.max))
    rows, wide = (max(round(size * side / max(high - low)), 1) for side in (high - low)[::-1])
    x = low[0] + (np.arange(wide * SAMPLES) + 0.5) / (wide * SAMPLES) * (high[0] - low[0])
    y = high[1] - (np.arange(rows * SAMPLES) + 0.5) / (rows * SAMPLES) * (high[1] - low[1])
    x, y = np.meshgrid(x, y)
    directions = np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3) @ axes
    return np.mean(points, axis=0) - away * axes[2], directions, (rows, wide)


def _corner_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """`(F, 3, 3)`: at each face's corners, the mean of the normals there that differ by less than SHARP_DEG."""
    large = np.cross(*(vertices[faces[:, k]] - vertices[faces[:, 0]] for k in (1, 2)))
    unit = large / (np.linalg.norm(large, axis=1, keepdims=True) + 1e-300)
    corner = np.arange(faces.size)
    touching = coo_matrix((np.ones(faces.size), (faces.ravel(), corner // 3)), (len(vertices), len(faces))).tocsr()
    at_corner = touching[faces.ravel()].tocoo()  # for each corner, all faces at its vertex
    alike = np.einsum("pc,pc->p", unit[at_corner.row // 3], unit[at_corner.col]) > np.cos(np.radians(SHARP_DEG))
    rows, columns = at_corner.row[alike], at_corner.col[alike]
    summed = coo_matrix((np.ones(len(rows)), (rows, columns)), (faces.size, len(faces))).tocsr() @ large
    summed /= np.linalg.norm(summed, axis=1, keepdims=True) + 1e-300
    return summed.reshape(-1, 3, 3)
