"""Pictures of arrangements in 3D, by pyvista, without a display."""

from __future__ import annotations

import colorsys
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..geometry.cameras import Camera
from ..geometry.meshes import Body
from ..io.palette import save_gif

if TYPE_CHECKING:
    from ..art.texturing import Painted
    from ..geometry.containers import Container
    from ..optimizer import Arrangement

GOLDEN_RATIO = 0.618033988749895


def colours(count: int) -> np.ndarray:
    """`(count, 3)` float64, RGB in [0, 1]. Neighbours differ: their hues are a golden ratio apart."""
    hsv = [((k * GOLDEN_RATIO) % 1, 0.45 + 0.2 * (k % 3) / 2, 0.95 - 0.15 * (k % 2)) for k in range(count)]
    rgb = [colorsys.hsv_to_rgb(hue, saturation, value) for hue, saturation, value in hsv]
    return np.array(rgb, np.float64).reshape(count, 3)


def scene_picture(
    bodies: Sequence[Body],
    matrices: np.ndarray,
    container: Container | None = None,
    size: tuple[int, int] = (800, 700),
    **look,
) -> np.ndarray:
    """One picture of a `Stage`, an RGB image `(H, W, 3)` uint8. look : further arguments of the stage."""
    stage = Stage(bodies, matrices, container, size, **look)
    try:
        return stage.picture(matrices)
    finally:
        stage.close()


class Stage:
    """Bodies and the container's edges in 3D, to be drawn again and again at other poses, by one thread.

    matrices `(N, 4, 4)` place the bodies' files in the world; the camera takes in what they span, or the container.
    hues `(N, 3)` or `(N, 4)`: the bodies' colours, RGB and opacity in [0, 1]; None for `colours`. azimuth and elevation
    name the direction of looking, as in `cameras`. shadows : views and silhouettes `(H, W)` in [0, 1], each thrown
    on a wall behind the bodies as that view sees them. painted : the bodies' own colours instead of hues, unlit; they
    stay where `matrices` place them. lamps : a lamp for each shadow, as in an installation. parallel : as
    orthographic views see it.
    """

    def __init__(
        self,
        bodies: Sequence[Body],
        matrices: np.ndarray,
        container: Container | None = None,
        size: tuple[int, int] = (800, 700),
        azimuth_deg: float = 35.0,
        elevation_deg: float = 22.0,
        hues: np.ndarray | None = None,
        shadows: Sequence[tuple[Camera, np.ndarray]] = (),
        painted: Painted | None = None,
        lamps: bool = False,
        parallel: bool = False,
    ):
        pyvista = _load_pyvista()
        self._plotter = plotter = pyvista.Plotter(off_screen=True, window_size=list(size), lighting="light kit")
        plotter.set_background("white")
        hues = colours(len(bodies)) if hues is None else hues
        self._actors = []
        if painted is not None:
            _add_painted(plotter, painted, matrices)
        else:
            poses = zip(bodies, matrices, hues, strict=True)
            self._actors = [_add_body(plotter, *one) for one in poses]
        if container is not None:
            hull = container.body
            shell = pyvista.PolyData.from_regular_faces(hull.solid_vertices + hull.centre, hull.solid_faces)
            if container.size is None:
                plotter.add_mesh(shell, color="#7a8ca0", opacity=0.12, smooth_shading=True)
            else:
                plotter.add_mesh(shell.extract_feature_edges(30), color="#3a4a5a", line_width=2)
        for view, image in shadows:
            _add_wall(plotter, view, image)
            if lamps:
                before = np.asarray(view.centre) - 1.2 * view.width * view.axes[2]
                lamp = pyvista.Sphere(radius=0.03 * view.width, center=before)
                plotter.add_mesh(lamp, color="#ffd34d", lighting=False)
        drawn = np.array(plotter.bounds).reshape(3, 2).T
        self._bounds = drawn if container is None or shadows else container.bounds
        self.look(azimuth_deg, elevation_deg)
        if parallel:
            plotter.enable_parallel_projection()
        plotter.enable_anti_aliasing("ssaa")

    def look(self, azimuth_deg: float, elevation_deg: float) -> None:
        """Look from another side."""
        centre, reach = self._bounds.mean(0), float(np.linalg.norm(np.ptp(self._bounds, axis=0)))
        forward = Camera(azimuth_deg, elevation_deg, reach).axes[2]
        self._plotter.camera_position = [centre - 1.9 * reach * forward, centre, (0, 0, 1)]
        self._plotter.camera.parallel_scale = reach / 2

    def turntable(self, matrices: np.ndarray, frames: int = 36, elevation_deg: float = 12.0) -> list[np.ndarray]:
        """Pictures from all around, in equal steps of azimuth from 0."""
        pictures = []
        for frame in range(frames):
            self.look(360.0 * frame / frames, elevation_deg)
            pictures.append(self.picture(matrices))
        return pictures

    def picture(self, matrices: np.ndarray) -> np.ndarray:
        """The bodies at other poses `(N, 4, 4)`: an RGB image `(H, W, 3)` uint8."""
        for actor, matrix in zip(self._actors, matrices, strict=bool(self._actors)):
            actor.user_matrix = matrix
        self._plotter.render()
        return self._plotter.screenshot(return_img=True)

    def close(self) -> None:
        """Give the drawing memory back."""
        self._plotter.close()


def exploded(bodies: Sequence[Body], matrices: np.ndarray, share: float = 0.6) -> np.ndarray:
    """Poses `(N, 4, 4)` drawn apart: each body's middle moved from the middle of all by `share` of its distance."""
    apart = np.array(matrices, np.float64)
    middles = np.stack([(pose @ [*body.centre, 1])[:3] for body, pose in zip(bodies, apart, strict=True)])
    apart[:, :3, 3] += share * (middles - middles.mean(0))
    return apart


def trimmed(picture: np.ndarray, margin: int = 12) -> np.ndarray:
    """A picture `(H, W, 3)` without its white border, but for `margin` pixels."""
    rows, columns = (np.flatnonzero((picture < 250).any(2).any(axis)) for axis in (1, 0))
    if not len(rows):
        return picture
    (top, bottom), (left, right) = ((max(at[0] - margin, 0), at[-1] + 1 + margin) for at in (rows, columns))
    return picture[top:bottom, left:right]


def _load_pyvista():
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")  # do not try X first
    import torch._dynamo  # noqa: F401 - triton's LLVM, which crashes where Mesa's has been loaded before it
    import pyvista  # isort: skip

    return pyvista


def installation(arrangement: Arrangement, size: tuple[int, int] = (1200, 900)) -> np.ndarray:
    """Pixels uint8 of the heap between lamps and walls, its shadows on the walls; from between the first two views."""
    run = arrangement
    azimuth = float(np.mean([camera.azimuth_deg for camera in run.cameras[:2]]))
    look = {"shadows": list(zip(run.cameras, run.images, strict=True)), "lamps": True, "azimuth_deg": azimuth}
    return trimmed(scene_picture(run.problem.bodies, run.matrices, size=size, elevation_deg=16.0, **look))


def save_turntable(path: str | Path, arrangement: Arrangement, painted: Painted | None = None) -> None:
    """Once around the heap, in parallel projection, so that each view's picture comes by."""
    run = arrangement
    stage = Stage(run.problem.bodies, run.matrices, size=(360, 360), painted=painted, parallel=True)
    save_gif(path, stage.turntable(run.matrices, elevation_deg=0.0))
    stage.close()


def _add_painted(plotter, painted: Painted, matrices: np.ndarray) -> None:
    pyvista = _load_pyvista()
    turns = np.repeat(matrices, np.diff(painted.first), axis=0)
    corners = np.einsum("fij,fcj->fci", turns[:, :3, :3], painted.corners) + turns[:, None, :3, 3]
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    surface = pyvista.PolyData.from_regular_faces(corners.reshape(-1, 3), faces)
    surface.active_texture_coordinates = painted.atlas.uv.reshape(-1, 2)
    texture = pyvista.numpy_to_texture(painted.atlas.texture(painted.colours))
    plotter.add_mesh(surface, texture=texture, lighting=False)


def _add_body(plotter, body: Body, matrix: np.ndarray, colour: np.ndarray):
    pyvista = _load_pyvista()
    surface = pyvista.PolyData.from_regular_faces(body.placed(np.eye(4)), body.solid_faces)
    return plotter.add_mesh(
        surface,
        color=tuple(colour[:3]),
        opacity=float([*colour, 1.0][3]),
        smooth_shading=True,
        split_sharp_edges=True,
        feature_angle=30,
        specular=0.15,
        user_matrix=matrix,
    )


def _add_wall(plotter, view: Camera, image: np.ndarray) -> None:
    """A square wall behind the view's volume, with its silhouette as a shadow."""
    pyvista = _load_pyvista()
    right, up, forward = view.axes * view.width / 2
    middle = np.asarray(view.centre) + 1.15 * forward
    corners = np.array([middle + x * right + y * up for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    wall = pyvista.PolyData.from_regular_faces(corners, np.array([[0, 1, 2, 3]]))
    wall.active_texture_coordinates = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    grey = np.repeat(np.uint8(235 - 170 * np.clip(image, 0, 1))[..., None], 3, 2)
    plotter.add_mesh(wall, texture=pyvista.numpy_to_texture(grey), lighting=False)
