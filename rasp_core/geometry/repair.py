"""A solid from the triangles of a file, mended as little as is needed; what was done is said.

From the least to the most: as given; equal corners merged (the usual state of an STL file); corners merged that differ
by rounding; repeated faces dropped; faces wound alike; edges split where another's corner lies on them; small holes
closed. The first that gives a closed surface is taken. No shell is dropped.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import manifold3d
import numpy as np
import trimesh
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..util.errors import MeshError
from .holes import find_holes, lid
from .shells import is_closed, mates, unite

REPAIRS = ("none", "close", "wrap")  # that a user may name; a cavity's opening is closed by "cap"


@dataclass(frozen=True)
class RepairLimits:
    """What is still a slip of the export. size : the longest edge of the bounding box."""

    rounding_of_size: float = 1e-5  # corners nearer than that are one
    said_of_size: float = 1e-7  # how far they may be apart, as numbers of 32 bits are, without a word
    seam_of_size: float = 1e-5  # how near a corner must be to an edge to lie on it
    lids_of_area: float = 0.01  # all lids together, of the surface
    specks_of_area: float = 1e-4  # loose faces that bound nothing, dropped


LIMITS = RepairLimits()


@dataclass(frozen=True)
class Repaired:
    """vertices `(V, 3)`, faces `(F, 3)`: the surface that was taken. solid : what it bounds. notes : what was done to
    the file's surface, a line each; none if it was taken as it is."""

    vertices: np.ndarray
    faces: np.ndarray
    solid: manifold3d.Manifold
    notes: tuple[str, ...]


def repair(vertices: np.ndarray, faces: np.ndarray, how: str = "close") -> Repaired:
    """The solid that triangles `(V, 3)`, `(F, 3)` bound.

    how : "none" refuses a surface with holes, "close" closes small ones and says so, "cap" all, "wrap" makes a solid of
    anything (`wrapping`). Raises MeshError if the surface stays open, with the number of its holes, and where the
    largest is.
    """
    for state in _mended(vertices, faces):
        if (found := _bounded(*state)) is not None:
            return found
    vertices, faces, notes = state
    if how != "none" and len(faces):
        closed = _holes_closed(vertices, faces, np.inf if how == "cap" else LIMITS.lids_of_area)
        if closed is not None and (found := _bounded(closed[0], closed[1], [*notes, closed[2]])) is not None:
            return found
    if how == "wrap" and len(faces):
        from .wrapping import wrap

        vertices, faces, note = wrap(vertices, faces)
        return Repaired(vertices, faces, unite(vertices, faces)[0], (note,))
    raise MeshError(_open_words(vertices, faces, how))


def _bounded(vertices: np.ndarray, faces: np.ndarray, notes: list[str]) -> Repaired | None:
    """What the surface bounds, None if it bounds no solid."""
    if not is_closed(faces):
        return None
    try:
        solid, assumed = unite(vertices, faces)
    except MeshError:
        return None
    return Repaired(vertices, faces, solid, (*notes, *assumed))


def _mended(vertices: np.ndarray, faces: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray, list[str]]]:
    """One state of the surface after another, no holes closed, with what was done so far beyond the merging of equal
    corners."""
    yield vertices, faces, []
    vertices, faces = _merged(vertices, faces)
    yield vertices, faces, []
    notes: list[str] = []
    for step in (_same_rounding, _without_repeats, _without_pairs, _wound_alike, _seams_split, _without_specks):
        changed = step(vertices, faces) if len(faces) else None
        if changed is not None:
            vertices, faces, note = changed
            notes = [*notes, note] if note else notes
            yield vertices, faces, notes


def _size(vertices: np.ndarray, faces: np.ndarray) -> float:
    return float(np.ptp(vertices[faces].reshape(-1, 3), axis=0).max())


def _merged(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners that are equal made one, in the file's order; faces without three corners dropped."""
    _, first, which = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    vertices, which = vertices[first[order]], place[which.ravel()]
    faces = which[faces]
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    used, faces = np.unique(faces, return_inverse=True)
    return vertices[used], faces.reshape(-1, 3).astype(np.int64)


def _same_rounding(vertices, faces):
    """Corners of open edges that differ by rounding made one."""
    if not len(faces):
        return None
    mate, count = mates(vertices, faces), len(faces)
    free = np.flatnonzero(mate < 0)
    border = np.unique(
        np.concatenate([faces[free % count, free // count], faces[free % count, (free // count + 1) % 3]])
    )
    size = _size(vertices, faces)
    pairs = cKDTree(vertices[border]).query_pairs(LIMITS.rounding_of_size * size, output_type="ndarray")
    if not len(pairs):
        return None
    graph = coo_matrix((np.ones(len(pairs)), (border[pairs[:, 0]], border[pairs[:, 1]])), (len(vertices),) * 2)
    which = connected_components(graph, directed=False)[1]
    _, first, which = np.unique(which, return_index=True, return_inverse=True)
    moved = np.linalg.norm(vertices - vertices[first][which], axis=1)
    merged = _merged(vertices[first][which], faces)
    words = f"{(moved > 0).sum()} corners that differ by rounding merged (up to {moved.max():.2g} m)"
    return *merged, words if moved.max() > LIMITS.said_of_size * size else ""


def _without_repeats(vertices, faces):
    """Of faces with the same corners that run the same way one kept; two that run against each other both left."""
    first = faces.argmin(1)
    turned = np.stack([faces[np.arange(len(faces)), (first + k) % 3] for k in range(3)], 1)
    _, kept = np.unique(turned, axis=0, return_index=True)
    if len(kept) == len(faces):
        return None
    return vertices, faces[np.sort(kept)], f"{len(faces) - len(kept)} repeated faces dropped"


def _without_pairs(vertices, faces):
    """Faces back to back, of the same corners wound both ways, dropped: they bound nothing."""
    _, which = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True)
    first = faces.argmin(1)
    upward = np.take_along_axis(faces, ((first + 1) % 3)[:, None], 1) < np.take_along_axis(
        faces, ((first + 2) % 3)[:, None], 1
    )
    net = np.bincount(which.ravel(), np.where(upward[:, 0], 1, -1))
    if (net != 0).all():
        return None
    kept = faces[net[which.ravel()] != 0]
    return vertices, kept, f"{len(faces) - len(kept)} faces back to back dropped"


def _wound_alike(vertices, faces):
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    trimesh.repair.fix_winding(mesh)
    turned = int((mesh.faces != faces).any(1).sum())
    if not turned:
        return None
    # neighbours agree now; each sheet that is closed is turned outwards as a whole
    fixed = np.asarray(mesh.faces).copy()
    return vertices, fixed, f"{turned} faces wound the other way turned"


def _seams_split(vertices, faces):
    """Open edges split where a corner of another open edge lies on them."""
    near, total = LIMITS.seam_of_size * _size(vertices, faces), 0
    for _ in range(8):
        mate, count = mates(vertices, faces), len(faces)
        free = np.flatnonzero(mate < 0)
        if not len(free):
            break
        face, side = free % count, free // count
        start, end = faces[face, side], faces[face, (side + 1) % 3]
        border = np.unique(np.concatenate([start, end]))
        tree = cKDTree(vertices[border])
        cut: dict[int, tuple[int, int]] = {}
        for f, k, a, b in zip(face.tolist(), side.tolist(), start.tolist(), end.tolist(), strict=True):
            if f in cut:
                continue
            axis = vertices[b] - vertices[a]
            length = float(np.linalg.norm(axis))
            if length == 0:
                continue
            around = border[tree.query_ball_point((vertices[a] + vertices[b]) / 2, length / 2 + near)]
            offset = vertices[around] - vertices[a]
            along = offset @ axis / length
            away = np.linalg.norm(offset - along[:, None] * axis / length, axis=1)
            on = around[(away < near) & (along > near) & (along < length - near)]
            if len(on):
                cut[f] = (k, int(on[np.argmin(np.linalg.norm(vertices[on] - vertices[a], axis=1))]))
        if not cut:
            break
        total += len(cut)
        whole = np.ones(len(faces), bool)
        whole[list(cut)] = False
        pieces = []
        for f, (k, middle) in cut.items():
            a, b, c = faces[f, k], faces[f, (k + 1) % 3], faces[f, (k + 2) % 3]
            pieces += [(a, middle, c), (middle, b, c)]
        faces = np.concatenate([faces[whole], np.array(pieces, np.int64)])
    return (vertices, faces, f"{total} edges split at corners that lie on them") if total else None


def _without_specks(vertices, faces):
    """Sheets that hang together with nothing and are of hardly any area dropped."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    labels = trimesh.graph.connected_component_labels(mesh.face_adjacency, node_count=len(faces))
    area = np.bincount(labels, mesh.area_faces)
    mate, count = mates(vertices, faces), len(faces)
    is_open = np.bincount(labels, (mate.reshape(3, count) < 0).any(0)) > 0
    specks = is_open & (area <= LIMITS.specks_of_area * area.sum())
    if not specks.any() or specks.all():
        return None
    kept = faces[~specks[labels]]
    share = area[specks].sum() / area.sum()
    return vertices, kept, f"{specks.sum()} loose scraps dropped ({share:.1e} of the area)"


def _holes_closed(vertices, faces, limit: float):
    """Lids on all holes, if together they are at most `limit` of the area."""
    holes = find_holes(vertices, faces)
    if not holes or not all(len(hole.corners) for hole in holes):
        return None
    lids = np.concatenate([lid(vertices, hole) for hole in holes])
    share = _area(vertices, lids) / _area(vertices, faces)
    if share > limit:
        return None
    several = "s" if len(holes) > 1 else ""
    words = f"{len(holes)} hole{several} closed, the longest {holes[0].length:.3g} m around ({share:.1e} of the area)"
    return vertices, np.concatenate([faces, lids]), words


def _area(vertices: np.ndarray, faces: np.ndarray) -> float:
    return float(trimesh.Trimesh(vertices, faces, process=False).area)


def _open_words(vertices: np.ndarray, faces: np.ndarray, how: str) -> str:
    """Why a surface bounds no solid."""
    if not len(faces):
        return "its faces lie back to back and enclose no volume; a solid is needed, not a sheet"
    holes = find_holes(vertices, faces)
    edges = int((mates(vertices, faces) < 0).sum())
    if not holes:
        return "the surface crosses or touches itself so that it bounds no solid; repair it in a mesh editor"
    largest, where = holes[0], ", ".join(f"{x:.3g}" for x in holes[0].centre)
    length = f"the largest {largest.length:.3g} m around, " if largest.length else ""
    remedy = (
        "--repair close closes small ones" if how == "none" else "close them in a mesh editor, or use --repair wrap"
    )
    return (
        f"the surface is open: {edges} open edges in {len(holes)} hole{'s' if len(holes) > 1 else ''}, {length}near "
        f"({where}); {remedy}"
    )
