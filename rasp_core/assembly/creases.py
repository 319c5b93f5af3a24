"""Creases of a surface: where it bends sharply outwards, as along the border of a fracture.

They are found in points spread over the surface, not in its triangles, so that scans and drawn meshes are treated
alike: the normals near a point are parted in two, and where both parts are large and far from parallel there is a
crease, on the line in which the two planes meet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..kernels.creases import Creases, Lookup


@dataclass(frozen=True)
class CreaseSettings:
    """neighbours : points by which a point is judged. least_bend_rad, largest_bend_rad : between the normals of both
    sides. least_share : of the neighbours on the smaller side. opposite : the cosine with a point's normal under which
    a neighbour lies on the other side of a thin wall. rounds : in which the normals are parted. apart_spacings : how
    far crease points are from each other, in the points' spacing.

    Roughness is how far normals near a point are from those of two smooth surfaces that meet in an edge: of the
    `rough_neighbours` nearest points within rough_spacings whose normals are within rough_cosine of the point's: those
    on the same face. A surface is rough from rough_rad, in the median of such neighbours. beside_spacings : how far a
    crease point beside a rough surface is from it.
    """

    neighbours: int = 28
    least_bend_rad: float = 0.7
    largest_bend_rad: float = 2.8
    least_share: float = 0.25
    opposite: float = -0.7
    rounds: int = 3
    apart_spacings: float = 1.5
    rough_neighbours: int = 80
    rough_spacings: float = 6.0
    rough_cosine: float = 0.6
    rough_rad: float = 0.05
    beside_spacings: float = 4.0


SETTINGS = CreaseSettings()


def find_creases(points: np.ndarray, normals: np.ndarray, spacing: float) -> Creases:
    """Crease points of a surface on which points `(P, 3)` with unit normals `(P, 3)` are spread `spacing` metres apart.

    Empty if it has none. The same points give the same creases.
    """
    if len(points) < SETTINGS.neighbours:
        return Creases(*np.zeros((3, 0, 3)))
    _, near = cKDTree(points).query(points, SETTINGS.neighbours)
    places, around = points[near], normals[near]
    here = np.einsum("pki,pi->pk", around, normals)
    same_wall = here > SETTINGS.opposite
    farthest = np.where(same_wall, here, 2).argmin(1)
    first, second = normals, around[np.arange(len(points)), farthest]
    for _ in range(SETTINGS.rounds):
        nearer = np.einsum("pki,pi->pk", around, second) > np.einsum("pki,pi->pk", around, first)
        on_first, on_second = (same_wall & ~nearer)[..., None], (same_wall & nearer)[..., None]
        first, second = unit((around * on_first).sum(1)), unit((around * on_second).sum(1))
    counts = np.stack([on_first.sum((1, 2)), on_second.sum((1, 2))])
    sides = zip((on_first, on_second), counts, strict=True)
    middles = [(places * on).sum(1) / np.maximum(count, 1)[:, None] for on, count in sides]
    cosine = (first * second).sum(1)
    kept = np.flatnonzero(
        (cosine < np.cos(SETTINGS.least_bend_rad))
        & (cosine > np.cos(SETTINGS.largest_bend_rad))
        & (counts.min(0) > SETTINGS.least_share * counts.sum(0))
        & (((middles[1] - middles[0]) * first).sum(1) < 0)  # bent outwards
    )
    first, second = first[kept], second[kept]
    along = unit(np.cross(first, second))
    planes = np.stack([first, second, along], axis=1)
    middle = (middles[0][kept] + middles[1][kept]) / 2
    offsets = [(first * middles[0][kept]).sum(1), (second * middles[1][kept]).sum(1), (along * middle).sum(1)]
    places = np.linalg.solve(planes, np.stack(offsets, axis=1)[..., None])[..., 0]
    thin = _apart(places, SETTINGS.apart_spacings * spacing)
    places, first, second = places[thin], first[thin], second[thin]
    return Creases(places, first, second)


def rough_points(points: np.ndarray, normals: np.ndarray, spacing: float) -> np.ndarray:
    """`(R,)` indices of points about which a surface is rough, as fractures are; arguments as of `find_creases`."""
    if not len(points):
        return np.zeros(0, np.int64)
    tree = cKDTree(points)
    rough = _roughness(points, normals, tree, spacing)
    around = tree.query(points, min(SETTINGS.neighbours, len(points)))[1]
    same_face = np.einsum("pki,pi->pk", normals[around], normals) > SETTINGS.rough_cosine
    return np.flatnonzero(np.nanmedian(np.where(same_face, rough[around], np.nan), axis=1) > SETTINGS.rough_rad)


def beside(creases: Creases, rough: np.ndarray, spacing: float) -> np.ndarray:
    """`(E,)` bool: which crease points lie beside rough surface, of which `rough` `(R, 3)` are points."""
    if not len(rough):
        return np.zeros(len(creases.points), bool)
    return cKDTree(rough).query(creases.points)[0] < SETTINGS.beside_spacings * spacing


def strips(creases: Creases, inwards: float) -> np.ndarray:
    """`(2, E, 3)`: a place on each of the two faces that meet in a crease, `inwards` metres from it."""
    found = []
    for face, other in ((creases.first, creases.second), (creases.second, creases.first)):
        away = unit((other * face).sum(1, keepdims=True) * face - other)
        found.append(creases.points + inwards * away)
    return np.stack(found)


def lookup(creases: Creases, reach: float, cell: float) -> Lookup:
    """A grid of cells of `cell` metres in which the nearest crease point is looked up from `reach` metres around."""
    points = creases.points if len(creases.points) else np.zeros((1, 3))
    around = int(np.ceil(reach / cell)) + 1
    low = points.min(0) - (around + 0.5) * cell
    home = np.floor((creases.points - low) / cell).astype(np.int64)
    shape = np.floor((points.max(0) - low) / cell).astype(np.int64) + around + 1
    steps = np.arange(-around, around + 1)
    offsets = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1).reshape(-1, 3)
    cells = home[:, None] + offsets
    apart = np.linalg.norm((cells + 0.5) * cell + low - creases.points[:, None], axis=2).ravel()
    flat = np.ravel_multi_index(cells.reshape(-1, 3).T, shape)
    near = np.flatnonzero(apart < reach + cell)
    order = near[np.argsort(-apart[near], kind="stable")]  # of all that are written to a cell the nearest stays
    nearest = np.full(shape, -1, np.int32)
    nearest.ravel()[flat[order]] = order // len(offsets)
    return Lookup(nearest, low, cell)


def moved(creases: Creases, rotation: np.ndarray, translation: np.ndarray) -> Creases:
    """The creases turned by `(3, 3)` and shifted by `(3,)`."""
    points, first, second = creases
    return Creases(points @ rotation.T + translation, first @ rotation.T, second @ rotation.T)


def joined(parts: list[Creases]) -> Creases:
    """All creases of several surfaces."""
    return Creases(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _roughness(points, normals, tree, spacing: float) -> np.ndarray:
    """`(P,)` radians: how far normals near each point are from those of two surfaces of constant curvature that meet in
    an edge."""
    reach = SETTINGS.rough_spacings * spacing
    distance, near = tree.query(points, min(SETTINGS.rough_neighbours, len(points)), distance_upper_bound=reach)
    found = np.isfinite(distance)
    near = np.where(found, near, 0)
    around = normals[near]
    along = np.einsum("pki,pi->pk", around, normals)
    used = found & (along > SETTINGS.rough_cosine)
    offset = (points[near] - points[:, None]) / spacing
    offset = offset - np.einsum("pki,pi->pk", offset, normals)[..., None] * normals[:, None]
    first, second = normals, around[np.arange(len(points)), np.where(used, along, 2).argmin(1)]
    for _ in range(SETTINGS.rounds):
        nearer = np.einsum("pki,pi->pk", around, second) > np.einsum("pki,pi->pk", around, first)
        first, second = (unit((around * (used & side)[..., None]).sum(1)) for side in (~nearer, nearer))
    rest = 0.0
    for side in (used & ~nearer, used & nearer):
        terms = np.concatenate([np.ones((*side.shape, 1)), offset], axis=2) * side[..., None]
        square = np.einsum("pki,pkj->pij", terms, terms) + 1e-2 * np.eye(4)  # the offsets lie in a plane
        fit = np.linalg.solve(square, np.einsum("pki,pkj->pij", terms, around))
        rest = rest + ((around * side[..., None] - terms @ fit) ** 2).sum((1, 2))
    return np.sqrt(rest / np.maximum(used.sum(1) - 6, 1))


def _apart(places: np.ndarray, gap: float) -> np.ndarray:
    """Indices of points of which no two are nearer than `gap`, each other point being near one of them."""
    tree, free, kept = cKDTree(places) if len(places) else None, np.ones(len(places), bool), []
    for i in np.random.default_rng(0).permutation(len(places)):
        if free[i]:
            kept.append(i)
            free[tree.query_ball_point(places[i], gap)] = False
    return np.array(kept, np.int64)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors `(..., 3)` with length 1; 0 stays 0."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)
