"""Things on a light table, whole or cut by a plane with every cut closed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import manifold3d
import numpy as np

from ..exact.certificate import placed_solid
from ..geometry.cameras import Camera
from ..geometry.containers import Container
from ..geometry.meshes import Body
from .lamplight import Lamp, Surface, picture
from .scene3d import colours

TABLE, SHELL, STONE = (1.0, 1.0, 1.0), (0.62, 0.68, 0.74), (0.55, 0.53, 0.50)
BRIGHT, DAYLIGHT = 0.42, (0.85, 0.84, 0.82)
CUT = 0.55  # how much of its colour a cut face keeps; the rest is white
EDGE = 0.006  # of a container's size: the radius of the line along its cut


@dataclass(frozen=True)
class Knife:
    """A plane through `point` `(3,)`; what lies on the side that `normal` `(3,)` points to is taken away."""

    normal: Sequence[float]
    point: Sequence[float]


def on_table(
    surfaces: Sequence[Surface], size: int = 400, azimuth_deg: float = 20.0, elevation_deg: float = 18.0
) -> np.ndarray:
    """Surfaces on a light table, in daylight from above, from the right: pixels uint8, the longer side of `size`."""
    points = np.concatenate([surface.vertices for surface in surfaces])
    middle, reach = (points.min(0) + points.max(0)) / 2, float(np.linalg.norm(np.ptp(points, axis=0)))
    around = 20 * reach * np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    table = Surface(
        around + np.array([*middle[:2], points[:, 2].min()]), np.array([[0, 1, 2], [0, 2, 3]]), TABLE, body=False
    )
    lamp = Lamp(Camera(azimuth_deg + 35.0, 55.0, 40 * reach, tuple(middle)), DAYLIGHT, blur_deg=2.0)
    frame = points + 0.03 * (points - middle)
    return picture([*surfaces, table], [lamp], azimuth_deg, elevation_deg, size, 18.0, frame, BRIGHT)


def stages(
    container: Container,
    bodies: Sequence[Body],
    matrices: np.ndarray,
    normal: Sequence[float] = (0.0, -1.0, 0.0),
    turn: np.ndarray | None = None,
    foot: bool = False,
    **look,
) -> list[np.ndarray]:
    """Three pictures: the empty container, the set of bodies, and the packed state, cut through the middle.

    normal : of the knife, to the side that is taken away, after all is turned upright by `turn` `(3, 3)`. foot : the
    container stands on a pedestal. look : of `on_table`, for the container.
    """
    empty = shell(container, turn)
    under = [pedestal(empty)] if foot else []
    points = empty[0].vertices
    knife = Knife(normal, (points.min(0) + points.max(0)) / 2)
    packed = shell(container, turn, knife) + cut(bodies, matrices, knife, turn)
    laid = whole(bodies, set_out(bodies))
    return [on_table(empty + under, **look), on_table(laid, 360, 0.0, 42.0), on_table(packed + under, **look)]


def in_box(
    bodies: Sequence[Body], matrices: np.ndarray, box: Container, size: int = 400, azimuth_deg=30.0, elevation_deg=18.0
) -> np.ndarray:
    """Bodies that `matrices` `(N, 4, 4)` place, on the floor of a box of which the edges are drawn."""
    return on_table([*whole(bodies, matrices), *box_edges(box)], size, azimuth_deg, elevation_deg)


def box_edges(box: Container) -> list[Surface]:
    """The twelve edges of a box as thin rods, which cast no shadow."""
    import trimesh

    corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * np.ptp(box.bounds, axis=0)
    corners += box.bounds[0]
    ends = [(i, j) for i in range(8) for j in range(i) if np.sum(corners[i] != corners[j]) == 1]
    radius = 0.004 * float(np.linalg.norm(np.ptp(box.bounds, axis=0)))
    rods = [trimesh.creation.cylinder(radius, segment=corners[[i, j]], sections=6) for i, j in ends]
    return [Surface(rod.vertices, rod.faces, SHELL, glow=True) for rod in rods]


def whole(
    bodies: Sequence[Body], matrices: np.ndarray, hues: np.ndarray | None = None, shift: Sequence[float] = (0, 0, 0)
) -> list[Surface]:
    """Bodies that `matrices` `(N, 4, 4)` place, all moved by `shift` `(3,)`; hues `(N, 3)`, None for `colours`."""
    hues = colours(len(bodies)) if hues is None else hues
    placed = zip(bodies, matrices, hues, strict=True)
    return [Surface(body.placed(m) + np.asarray(shift), body.solid_faces, hue) for body, m, hue in placed]


def shell(container: Container, turn: np.ndarray | None = None, knife: Knife | None = None) -> list[Surface]:
    """A container's wall, turned by `turn` `(3, 3)`; what a knife leaves of it, open, with a line along the cut."""
    import trimesh

    hull = container.body
    solid = placed_solid(hull, np.eye(4)).transform(np.column_stack([_turn(turn), np.zeros(3)]))
    if knife is None:
        mesh = solid.to_mesh64()
        return [Surface(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts), SHELL)]
    vertices, faces, closing = _cut(solid, knife)
    edges = np.sort(faces[closing][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges, times = np.unique(edges, axis=0, return_counts=True)
    radius, found = EDGE * float(np.linalg.norm(np.ptp(vertices, axis=0))), []
    for segment in vertices[edges[times == 1]]:
        if np.linalg.norm(segment[1] - segment[0]) > 1e-3 * radius:
            rod = trimesh.creation.cylinder(radius, segment=segment, sections=8)
            found.append(Surface(rod.vertices, rod.faces, 0.7 * np.array(SHELL)))
    return [Surface(vertices, faces[~closing], SHELL), *found]


def cut(bodies: Sequence[Body], matrices: np.ndarray, knife: Knife, turn: np.ndarray | None = None) -> list[Surface]:
    """What a knife leaves of placed bodies, each cut closed by a face in a lighter colour of the body's own."""
    turned, found = np.column_stack([_turn(turn), np.zeros(3)]), []
    for body, matrix, hue in zip(bodies, matrices, colours(len(bodies)), strict=True):
        vertices, faces, closing = _cut(placed_solid(body, matrix).transform(turned), knife)
        found += [Surface(vertices, faces[~closing], hue), Surface(vertices, faces[closing], 1 - CUT * (1 - hue))]
    return [surface for surface in found if len(surface.faces)]


def _turn(turn: np.ndarray | None) -> np.ndarray:
    return np.eye(3) if turn is None else np.asarray(turn, float)


def _cut(solid: manifold3d.Manifold, knife: Knife) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, faces, and which of the faces `(F,)` close the cut."""
    normal = np.asarray(knife.normal, float) / np.linalg.norm(knife.normal)
    mesh = solid.trim_by_plane(-normal, -float(normal @ knife.point)).to_mesh64()
    vertices, faces = np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts)
    size = float(np.abs(vertices).max()) if len(vertices) else 1.0
    on_plane = np.abs((vertices - np.asarray(knife.point)) @ normal) < 1e-7 * size
    return vertices, faces, on_plane[faces].all(1)


def set_out(bodies: Sequence[Body], shape: float = 1.2) -> np.ndarray:
    """Poses `(N, 4, 4)` of bodies that stand in rows on z = 0, the largest at the back; rows `shape` times as wide as
    all are deep."""
    order = np.argsort([-body.half_extents[2] for body in bodies], kind="stable")
    sizes = 2.15 * np.array([max(body.half_extents[:2]) for body in bodies])
    row = np.sqrt((sizes**2).sum() * shape)
    matrices, x, y, deep = np.tile(np.eye(4), (len(bodies), 1, 1)), 0.0, 0.0, 0.0
    for i in order:
        if x + sizes[i] > row and x > 0:
            x, y, deep = 0.0, y - deep, 0.0
        matrices[i, :3, 3] = [x + sizes[i] / 2, y - sizes[i] / 2, bodies[i].half_extents[2]] - bodies[i].centre
        x, deep = x + sizes[i], max(deep, sizes[i])
    return matrices


def pedestal(surfaces: Sequence[Surface], high: float = 0.3) -> Surface:
    """A round foot under surfaces, `high` of their height."""
    import trimesh

    points = np.concatenate([surface.vertices for surface in surfaces])
    low, size = points.min(0), np.ptp(points, axis=0)
    foot = points[points[:, 2] < low[2] + 0.05 * size[2]]
    middle, radius = (foot.min(0) + foot.max(0)) / 2, 0.62 * float(np.ptp(foot[:, :2], axis=0).max())
    levels = [
        (1.25, -high),
        (1.25, -0.85 * high),
        (1.0, -0.78 * high),
        (0.9, -0.12 * high),
        (1.1, -0.08 * high),
        (1.1, 0),
    ]
    outline = [(0, -high * size[2]), *((radius * r, h * size[2]) for r, h in levels), (0, 0)]
    turned = trimesh.creation.revolve(np.array(outline), sections=64)
    return Surface(turned.vertices + np.array([*middle[:2], low[2]]), turned.faces, STONE)
