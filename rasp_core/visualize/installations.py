"""Heaps, boxes and vessels in dark rooms, with lamps before them and their shadows on the walls."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..geometry.cameras import Camera, box_views
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..optimizer import Arrangement
from .lamplight import Lamp, Surface, picture
from .scene3d import colours
from .studio import box_edges, whole

ROW = ((0.93, 0.42, 0.35), (0.98, 0.74, 0.30), (0.42, 0.74, 0.66), (0.50, 0.60, 0.92))  # the heaps of a row
PLASTER, WOOD = (0.86, 0.84, 0.80), (0.80, 0.58, 0.36)
AWAY = 1.25  # of a view's width: how far behind the middle of a heap a wall stands
WARM, ORANGE = (1.05, 0.92, 0.72), (1.35, 0.62, 0.18)


def shades(colour: Sequence[float], count: int) -> np.ndarray:
    """`(count, 3)` RGB: one colour, lighter and darker from one to the next, so that neighbours are told apart."""
    hue, saturation, value = colorsys.rgb_to_hsv(*colour)
    steps = (np.arange(count) * 0.618) % 1 - 0.5
    return np.array([colorsys.hsv_to_rgb(hue + 0.03 * s, saturation * (1 - 0.3 * s), value + 0.15 * s) for s in steps])


def wall(view: Camera, away: float, right=(-0.5, 0.5), up=(-0.5, 0.5), colour: Sequence[float] = PLASTER) -> Surface:
    """A rectangle across the view's direction, `away` behind its middle; away, right and up in the view's widths."""
    axes = view.axes * view.width
    middle = np.asarray(view.centre) + away * axes[2]
    corners = [middle + right[i] * axes[0] + up[j] * axes[1] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
    return Surface(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]]), colour, body=False)


def row(heaps: Sequence[Arrangement], size: int = 1200) -> np.ndarray:
    """One installation of heaps side by side, each with a front and a top view: the fronts' shadows on the back wall,
    the tops' on the floor. Pixels uint8, the longer side of `size`."""
    edge = heaps[0].cameras[0].width
    surfaces, lamps, reach = [], [], 0.98 * edge
    for k, (run, colour) in enumerate(zip(heaps, ROW * len(heaps), strict=False)):
        shift = np.array([(k - (len(heaps) - 1) / 2) * reach, 0.0, 0.0])
        surfaces += whole(run.problem.bodies, run.matrices, shades(colour, len(run.problem.bodies)), shift)
        for view in run.cameras:
            moved = replace(view, centre=tuple(np.asarray(view.centre) + shift), width=1.0 * edge)
            lamps.append(Lamp(moved, colour=WARM, soft=0.1))
    front, top = (replace(view, width=edge, centre=(0, 0, 0)) for view in heaps[0].cameras)
    half, back, below = 0.49 * len(heaps) + 0.12, 1.75, 0.8
    surfaces += [wall(front, back, (-9, 9), (-below, 9)), wall(top, below, (-9, 9), (-9, back))]
    frame = edge * np.array([(x, *yz) for x in (-half, half) for yz in ((-0.62, -below), (back, 0.62))])
    return picture(surfaces, lamps, 0.0, 30.0, size, 20.0, frame)


def corner(
    bodies: Sequence[Body],
    matrices: np.ndarray,
    views: Sequence[Camera],
    hues: np.ndarray,
    size: int = 640,
    light: Sequence[float] = WARM,
    azimuth_deg: float = 45.0,
    elevation_deg: float = 24.0,
    away: float = 1.0,
    more: Sequence[Surface] = (),
) -> np.ndarray:
    """Bodies that `matrices` `(N, 4, 4)` place, in colours `(N, 3)`, between lamps and a wall for each view, `away` of
    the views' width behind the middle. more : surfaces besides. Pixels uint8, the longer side of `size`."""
    lamps = [Lamp(view, colour=light) for view in views]
    walls = [wall(view, away, *_extents(view, views, away)) for view in views]
    frame = np.concatenate([wall(view, away, (-0.56, 0.56), (-0.56, 0.56)).vertices for view in views])
    surfaces = [*whole(bodies, matrices, hues), *walls, *more]
    return picture(surfaces, lamps, azimuth_deg, elevation_deg, size, 24.0, frame)


def before_wall(arrangement: Arrangement, view: int, size: int = 520, raised_deg: float = 38.0) -> np.ndarray:
    """The heap, the lamp of one of its views alone, and that view's wall, from above the lamp."""
    run, camera = arrangement, arrangement.cameras[view]
    hues = colours(len(run.problem.bodies))
    near, far = (wall(camera, away, (-0.52, 0.52), (-0.56, 0.52)).vertices for away in (-0.2, AWAY))
    frame = np.concatenate([near[:2], far])
    surfaces = [*whole(run.problem.bodies, run.matrices, hues), wall(camera, AWAY, (-9, 9), (-9, 9))]
    look = {"azimuth_deg": camera.azimuth_deg, "elevation_deg": camera.elevation_deg + raised_deg}
    return picture(surfaces, [Lamp(camera, WARM)], **look, size=size, frame=frame)


def stacked(upper: Arrangement, lower: Arrangement, size: int = 640) -> np.ndarray:
    """Two heaps, one above the other, in orange light, with their shadows on two walls and one on the floor for both.

    Their views are from the front, from the side and from above. Pixels uint8, the longer side of `size`.
    """
    edge, lamps, surfaces = lower.cameras[0].width, [], []
    for run, height in ((lower, 0.0), (upper, 0.98 * edge)):
        surfaces += whole(run.problem.bodies, run.matrices, shades(WOOD, len(run.problem.bodies)), (0.0, 0.0, height))
        lamps += [Lamp(replace(view, centre=(0.0, 0.0, height)), ORANGE) for view in run.cameras[:2]]
    front, side, top = (replace(view, centre=(0.0, 0.0, 0.0)) for view in lower.cameras)
    lamps.append(Lamp(top, ORANGE))
    away = 1.12
    surfaces += [wall(front, away, (-away, 9), (-away, 9)), wall(side, away, (-9, away), (-away, 9))]
    surfaces += [wall(top, away, (-away, 9), (-9, away))]
    frame = edge * np.array([(-away, -0.75, 1.64), (-0.62, -0.62, -away), (0.62, -0.62, -away), (0.75, away, 1.64)])
    return picture(surfaces, lamps, 45.0, 22.0, size, 20.0, frame)


def _extents(view: Camera, views: Sequence[Camera], away: float):
    """How far a wall reaches to its right and up, in widths: to the other walls, and a good way where none is."""
    axes, reach = view.axes, [[-9.0, 9.0], [-9.0, 9.0]]
    for other in views:
        for axis in range(2):
            along = float(axes[axis] @ other.axes[2])
            if along > 0.99:
                reach[axis][1] = away
            if along < -0.99:
                reach[axis][0] = -away
    return reach


def box_corner(
    bodies: Sequence[Body], matrices: np.ndarray, box: Container, hues: np.ndarray | None = None, size: int = 540
) -> np.ndarray:
    """Bodies that `matrices` `(N, 4, 4)` place in a box, between lamps as wide as the box and three walls.

    Where light falls into a shadow, a gap goes all the way through. Pixels uint8, the longer side of `size`.
    """
    edges, middle = np.ptp(box.bounds, axis=0), tuple(box.bounds.mean(0))
    views = box_views(1.5 * float(edges.max()), middle)
    hues = colours(len(bodies)) if hues is None else hues
    return corner(bodies, matrices, views, hues, size=size, away=1.0, more=box_edges(box))
