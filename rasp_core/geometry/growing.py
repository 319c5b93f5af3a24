"""Solids grown on all sides, and containers shrunk: what lies apart as grown solids lies apart by that much more.

Minkowski sums and differences with a polyhedron about a ball, by manifold3d: what they keep clear is never less than
the ball's radius, and in the directions of the file's axes it is just that, so that blocks stay blocks. What has too
many triangles is simplified before, and if it still has, moved out on a grid of distances; by so much that an exact
measure of the gap finds the radius.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import manifold3d
import numpy as np
import trimesh
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..io.kept_arrays import kept
from ..util import o3d
from ..util.errors import InputError
from .containers import Container, FreeBox, box
from .meshes import Body, SolidKey, make_body
from .sdf import Grid
from .shells import to_manifold
from .zones import without

SPARE = 1e-4  # of the radius, that solids are grown more than asked, for what rounding takes
MOST_TRIANGLES = 1500  # of what is grown or shrunk by a sum, which takes five milliseconds for each
SIMPLER_BY = 0.05, 0.1, 0.2  # of the radius: how far a surface of more triangles may stray, until it has fewer
MOST_CELLS = 96  # along the grid of what has more
GRID_BEYOND = 8  # radii that it reaches beyond, both sides together
GRID_SIMPLER_BY = 0.1  # of the radius: how far the grid's steps may be smoothed away
MOST_ROUNDS = 6  # until such a surface is far enough
FEW_TRIANGLES = 100  # up to which a grown solid is exact; else it may be simplified,
SIMPLIFIED_BY = 0.01  # of the radius, by which it is grown more
MOST_PIECES = 64  # convex ones that a solid may consist of
OUTSIDE = 4  # radii of space about a solid, of which its surface bounds the inside
_FORMAT = 1  # change it when what is cached changes


class TooNarrow(InputError):
    """Nothing of a container is so far from its wall."""


def ball(radius: float) -> manifold3d.Manifold:
    """A convex polyhedron of 26 faces at `radius` from the origin, across the axes and all diagonals of a cube."""
    corner = np.array([1, np.sqrt(2) - 1, np.sqrt(3) - np.sqrt(2)])
    signs = np.array(list(itertools.product((-1, 1), repeat=3)))
    corners = [corner[list(order)] * signs for order in itertools.permutations(range(3))]
    return manifold3d.Manifold.hull_points(radius * np.concatenate(corners))


def grown(body: Body, radius: float) -> Body:
    """A body whose solid holds every point within `radius` metres of `body`, and little more.

    Its `core` is `body`, whose volume and file's coordinates it has: a matrix from file to world places both. Kept on
    disk under the hash of its geometry. Raises InputError unless the radius is positive and finite.
    """
    if not 0 < radius < np.inf:
        raise InputError(f"a body is grown by a positive length, got {radius:g} m")
    vertices, faces = _cached(SolidKey(body), radius)
    middle = (vertices.max(0) + vertices.min(0)) / 2
    return replace(
        body,
        solid_vertices=vertices - middle,
        solid_faces=faces,
        centre=body.centre + middle,
        core=body,
        growth=radius,
    )


def shrunk(container: Container, margin: float) -> Container:
    """The places of a container that lie `margin` metres or more from its wall, views kept; a box may also grow, by a
    negative margin. Its `whole` is `container`. Raises TooNarrow if nothing is left.
    """
    if container.zones:
        larger = [grown(zone, margin) if margin > 0 else zone for zone in container.zones]
        return without(shrunk(container.base, margin), larger, whole=container)
    nothing = TooNarrow(f"nothing of the container is {margin:.3g} m from its wall; ask for less wall clearance")
    if container.size is not None:
        size = container.size - 2 * margin
        if (size <= 0).any():
            raise nothing
        return Container(box(size).body, size, container.directions, container)
    if margin <= 0:
        return container
    body = container.body
    wall = body.manifold
    outside, coarse = _complement(wall, margin), _coarse(wall, margin)
    if coarse.num_tri() <= MOST_TRIANGLES:
        inside = _until_kept(margin, lambda reach: coarse.minkowski_difference(ball(reach)), outside.min_gap)
    else:
        grid = _distances(body, margin)
        if grid.values.min() >= -margin:
            raise nothing
        inside = _until_kept(
            margin, lambda reach: wall ^ _within(grid, -reach, GRID_SIMPLER_BY * margin), outside.min_gap
        )
    if inside.volume() <= 0:
        raise nothing
    mesh = inside.translate(body.centre).to_mesh64()
    left = make_body(body.name, np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))
    return Container(left, None, container.directions, container)


def shrunk_shape(shape: FreeBox, margin: float) -> FreeBox:
    """The same of a box to be found: its zones are larger by the margin, and lie above a floor that is higher by it.

    Raises TooNarrow if nothing is left between its given edges.
    """
    edges = tuple(None if edge is None else edge - 2 * margin for edge in shape.edges)
    if any(edge is not None and edge <= 0 for edge in edges):
        raise TooNarrow(f"nothing between the fixed edges is {margin:.3g} m from the wall")
    larger = [grown(zone, margin) if margin > 0 else zone for zone in shape.zones]
    return replace(shape, edges=edges, margin=margin, zones=tuple(z.moved(np.array([0, 0, -margin])) for z in larger))


@lru_cache(maxsize=1024)
def _cached(known: SolidKey, radius: float) -> tuple[np.ndarray, np.ndarray]:
    body = known.body

    def grow() -> dict[str, np.ndarray]:
        return dict(zip(("vertices", "faces"), _grow(body, radius), strict=True))

    found = kept("grown", f"{_FORMAT} {body.digest} {radius!r}", grow)
    return found["vertices"], found["faces"]


def _grow(body: Body, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices `(V, 3)` and faces `(F, 3)` of a body's solid grown by `radius`."""
    solid, simpler = body.manifold, SIMPLIFIED_BY * radius
    fine = solid.num_tri() > FEW_TRIANGLES
    reach = radius * (1 + SPARE) + (simpler if fine else 0)
    pieces, coarse = _convex_pieces(body, radius), _coarse(solid, radius)

    def clear_of(found: manifold3d.Manifold, most: float) -> float:
        return solid.min_gap(_complement(found, radius), most)

    if pieces:
        large = manifold3d.Manifold.batch_boolean([_hull_sum(piece, reach) for piece in pieces], manifold3d.OpType.Add)
    elif coarse is solid:
        large = solid.minkowski_sum(ball(reach))
    elif coarse.num_tri() <= MOST_TRIANGLES:
        large = _until_kept(reach, lambda further: coarse.minkowski_sum(ball(further)), clear_of)
    else:
        grid = _distances(body, radius)
        large = _until_kept(reach, lambda more: solid + _within(grid, more, GRID_SIMPLER_BY * radius), clear_of)
    mesh = (large.simplify(simpler) if fine else large).to_mesh64()
    return np.array(mesh.vert_properties, np.float64)[:, :3], np.array(mesh.tri_verts, np.int64)


def _until_kept(
    reach: float,
    make: Callable[[float], manifold3d.Manifold],
    gap: Callable[[manifold3d.Manifold, float], float],
) -> manifold3d.Manifold:
    """What `make` makes for a reach of so much more that its exact gap is `reach` at least."""
    further, found = reach, make(reach)
    for _ in range(MOST_ROUNDS):
        short = reach - gap(found, reach)
        if short <= 0 or found.is_empty():
            break
        further += 1.05 * short
        found = make(further)
    return found


def _within(grid: Grid, level: float, simpler: float) -> manifold3d.Manifold:
    """Where a grid is below a level, by marching cubes."""
    from skimage.measure import marching_cubes

    vertices, faces, _, _ = marching_cubes(
        np.where(grid.values == level, level + 1e-9 * grid.spacing, grid.values), level
    )
    mesh = trimesh.Trimesh(vertices * grid.spacing + grid.origin, faces, process=True)
    if mesh.volume < 0:
        mesh.invert()
    return to_manifold(np.asarray(mesh.vertices), np.asarray(mesh.faces)).simplify(simpler)


def _distances(body: Body, radius: float) -> Grid:
    """Signed distances about a body, as fine as half a radius, but for bodies of a great many."""
    import igl

    extent = 2 * body.half_extents
    spacing = max(radius / 2, float(extent.max()) / MOST_CELLS)
    shape = np.ceil((extent + GRID_BEYOND * radius) / spacing).astype(int) + 5
    axes = [spacing * (np.arange(n) - (n - 1) / 2) for n in shape]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    caster = o3d.caster([(body.solid_vertices, body.solid_faces)])
    distance = caster.compute_distance(points.astype(np.float32)).numpy().astype(np.float64)
    inside = igl.fast_winding_number(body.solid_vertices, body.solid_faces, points) > 0.5
    values = np.where(inside, -distance, distance).reshape(shape)
    return Grid(values, np.array([axis[0] for axis in axes]), spacing)


def _hull_sum(points: np.ndarray, radius: float) -> manifold3d.Manifold:
    """The convex hull of points `(V, 3)`, grown."""
    return manifold3d.Manifold.hull_points(points).minkowski_sum(ball(radius))


def _convex_pieces(body: Body, radius: float) -> list[np.ndarray]:
    """Corners `(V, 3)` of convex pieces, as the file has them, whose hulls hold the solid and next to nothing besides,
    for the radius that it is grown by; none if it is not made so."""
    _, label = connected_components(_joining(body.faces, len(body.vertices)), directed=False)
    order = np.argsort(label, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    pieces = [body.vertices[group] - body.centre for group in groups if len(group) > 3]
    if len(pieces) > MOST_PIECES:
        return []
    hulls = [manifold3d.Manifold.hull_points(piece) for piece in pieces]
    union = manifold3d.Manifold.batch_boolean(hulls, manifold3d.OpType.Add)
    besides = (union - body.manifold).volume()
    return pieces if besides < SIMPLIFIED_BY * radius * body.manifold.surface_area() else []


def _joining(faces: np.ndarray, count: int) -> coo_matrix:
    """Which of `count` vertices the edges of faces `(F, 3)` join."""
    ends = np.concatenate([faces[:, :2], faces[:, 1:]])
    return coo_matrix((np.ones(len(ends)), ends.T), (count, count))


def _coarse(solid: manifold3d.Manifold, radius: float) -> manifold3d.Manifold:
    """The solid itself, or, of too many triangles, one whose surface strays a little, with fewer."""
    coarse = solid
    for stray in SIMPLER_BY:
        if coarse.num_tri() > MOST_TRIANGLES:
            coarse = solid.simplify(stray * radius)
    return coarse


def _complement(solid: manifold3d.Manifold, radius: float) -> manifold3d.Manifold:
    """Space about a solid that does not belong to it."""
    low, high = np.array(solid.bounding_box()).reshape(2, 3) + OUTSIDE * radius * np.array([[-1], [1]])
    return manifold3d.Manifold.cube(high - low).translate(low) - solid
