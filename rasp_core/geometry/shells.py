"""Closed shells of triangles, and the one solid that several of them bound: exact, by manifold3d."""

from __future__ import annotations

from collections.abc import Sequence

import manifold3d
import numpy as np
import trimesh

from ..util.errors import MeshError

OVERLAP = 0.01  # of shells' volume: what they may share without a word, as pieces of a decomposition do
SAME_VOLUME = 1e-6  # fraction of a volume within which two count as equal


def to_manifold(vertices: np.ndarray, faces: np.ndarray) -> manifold3d.Manifold:
    """`(V, 3)`, `(F, 3)` -> a manifold3d solid. Raises MeshError if the surface is not closed."""
    solid = manifold3d.Manifold(
        manifold3d.Mesh64(
            np.ascontiguousarray(vertices, np.float64).reshape(-1, 3),
            np.ascontiguousarray(faces, np.uint64).reshape(-1, 3),
        )
    )
    if solid.status() != manifold3d.Error.NoError:
        raise MeshError(f"the surface is not closed ({solid.status().name})")
    return solid


def half_edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of faces `(F, 3)`: a number `(3F,)` for each directed edge, and that of its opposite. Edge k of face f is at
    `f + k * F`, from corner k to the next."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    count = int(faces.max()) + 1
    return edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0]


def is_closed(faces: np.ndarray) -> bool:
    """True if every directed edge of `(F, 3)` faces is met by as many opposite ones."""
    if len(faces) == 0:
        return False
    forward, backward = half_edges(faces)
    return bool(np.array_equal(np.sort(forward), np.sort(backward)))


def mates(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """`(3F,)`: for each edge, numbered as by `half_edges`, the opposite one of the neighbouring face; -1 at a border.

    About an edge of more than two faces each is paired with the one that bounds the same wedge of solid, so that shells
    that touch along an edge are told apart.
    """
    forward, backward = half_edges(faces)
    order = np.argsort(forward, kind="stable")
    low = np.searchsorted(forward[order], backward, "left")
    found = np.searchsorted(forward[order], backward, "right") - low
    mate = np.where(found > 0, order[np.minimum(low, len(order) - 1)], -1)
    counts = np.unique(forward, return_inverse=True, return_counts=True)
    crowded = (counts[2][counts[1]] > 1) | (found > 1)
    if crowded.any():
        mate[crowded] = -1
        _pair_crowded(vertices, faces, np.flatnonzero(crowded), forward, mate)
    return mate


def _pair_crowded(vertices, faces, crowded, forward, mate) -> None:
    """Pair the edges numbered `crowded` by the angle of their faces about the edge."""
    count = len(faces)
    groups: dict[tuple[int, int], list[int]] = {}
    ends = np.stack([faces[crowded % count, crowded // count], faces[crowded % count, (crowded // count + 1) % 3]], 1)
    for edge, (a, b) in zip(crowded.tolist(), ends.tolist(), strict=True):
        groups.setdefault((min(a, b), max(a, b)), []).append(edge)
    for (a, b), edges in groups.items():
        axis = vertices[b] - vertices[a]
        length = np.linalg.norm(axis)
        axis = axis / length if length else np.array([0.0, 0.0, 1.0])
        first = np.eye(3)[np.abs(axis).argmin()]
        first = np.cross(axis, first) / np.linalg.norm(np.cross(axis, first))
        second = np.cross(axis, first)
        spokes = np.array([vertices[faces[e % count, (e // count + 2) % 3]] - vertices[a] for e in edges])
        along = [faces[e % count, e // count] == a for e in edges]
        angle = np.arctan2(spokes @ second, spokes @ first)
        # a face that runs along the axis has its solid at smaller angles: it meets the next lower one that runs back
        turn = sorted((round(float(angle[k]), 6), not along[k], edges[k]) for k in range(len(edges)))
        open_back: list[int] = []
        for _, runs_back, edge in turn + turn:
            if runs_back:
                if mate[edge] < 0 and edge not in open_back:
                    open_back.append(edge)
            elif mate[edge] < 0 and open_back:
                other = open_back.pop()
                mate[edge], mate[other] = other, edge


def split(vertices: np.ndarray, faces: np.ndarray) -> list[np.ndarray]:
    """The faces of each shell `(F_i, 3)`: those that hang together by edges.

    Edges of more than two faces join nothing at first; only if that leaves a shell open are they paired, see `mates`.
    """
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    labels = trimesh.graph.connected_component_labels(mesh.face_adjacency, node_count=len(faces))
    found = _groups(faces, labels)
    if len(found) == 1 or all(is_closed(group) for group in found):
        return found
    mate, count = mates(vertices, faces), len(faces)
    paired = np.flatnonzero(mate >= 0)
    labels = trimesh.graph.connected_component_labels(
        np.stack([paired % count, mate[paired] % count], 1), node_count=count
    )
    return _groups(faces, labels)


def _groups(faces: np.ndarray, labels: np.ndarray) -> list[np.ndarray]:
    return np.split(faces[np.argsort(labels, kind="stable")], np.cumsum(np.bincount(labels))[:-1])


def submesh(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The vertices that the faces use, and the faces numbered anew."""
    used, renumbered = np.unique(faces, return_inverse=True)
    return vertices[used], renumbered.reshape(-1, 3)


def unite(vertices: np.ndarray, faces: np.ndarray) -> tuple[manifold3d.Manifold, list[str]]:
    """One solid from a closed surface `(V, 3)`, `(F, 3)` of one or many shells, and lines on what was assumed.

    Shells that touch or overlap are united (Kitchen objects are sets of touching convex pieces). A shell within another
    is a cavity, and one within a cavity is solid again. A shell that is inside out, but within no other, is turned.

    Raises MeshError if a shell is not closed.
    """
    groups = split(vertices, faces)
    pieces = [to_manifold(*submesh(vertices, group)) for group in groups]
    if sum(piece.volume() for piece in pieces) < 0:
        groups = [group[:, ::-1] for group in groups]
        pieces = [to_manifold(*submesh(vertices, group)) for group in groups]
    inward = [k for k, piece in enumerate(pieces) if piece.volume() < 0]
    outward = [k for k, piece in enumerate(pieces) if piece.volume() > 0]
    solid = _add([pieces[k] for k in outward])
    sum_outward = sum(pieces[k].volume() for k in outward)
    if solid.volume() < (1 - SAME_VOLUME) * max((pieces[k].volume() for k in outward), default=0.0):
        # no union is smaller than what it unites: a shell crosses itself so that the boolean fails
        return to_manifold(vertices, faces), ["a shell crosses itself; taken as it is"]
    if not inward and solid.volume() > (1 - SAME_VOLUME) * sum_outward:
        return solid, []
    for k in inward:
        pieces[k] = to_manifold(*submesh(vertices, groups[k][:, ::-1]))
    return _by_place(solid, pieces, set(inward))


def _by_place(solid, pieces: Sequence[manifold3d.Manifold], inward: set[int]) -> tuple[manifold3d.Manifold, list[str]]:
    """The solid of shells of which some overlap or are wound inward. solid : the union of the others. pieces : what
    each encloses."""
    boxes = np.array([piece.bounding_box() for piece in pieces]).reshape(-1, 2, 3)
    volumes = np.array([piece.volume() for piece in pieces])
    within = [[j for j in range(len(pieces)) if _inside(pieces, boxes, volumes, k, j)] for k in range(len(pieces))]
    depth = np.array([len(outer) for outer in within])
    everything = _add(list(pieces))
    outermost = volumes[depth == 0].sum()
    if abs(everything.volume() - outermost) <= SAME_VOLUME * outermost:  # no two cross each other
        made = _add([pieces[k] for k in np.flatnonzero(depth == 0)])
        for level in range(1, depth.max(initial=0) + 1):
            layer = _add([pieces[k] for k in np.flatnonzero(depth == level)])
            made = made - layer if level % 2 else made + layer
        unlike = sum((depth[k] % 2 == 1) != (k in inward) for k in range(len(pieces)))
        return made, _words(unlike, "wound as if it lay elsewhere; taken as a cavity or as solid by its place")
    shared = 1 - solid.volume() / sum(volumes[k] for k in range(len(pieces)) if k not in inward)
    united = [f"shells that overlap by {shared:.1%} of their volume are united"] if shared > OVERLAP else []
    turned = [k for k in inward if not within[k] and (pieces[k] ^ solid).volume() <= SAME_VOLUME * volumes[k]]
    made = _add([solid, *(pieces[k] for k in turned)])
    for k in inward - set(turned):
        made -= pieces[k]
    return made, united + _words(len(turned), "inside out beside the others; turned")


def _inside(pieces, boxes, volumes, k: int, j: int) -> bool:
    """Whether piece k lies in piece j and does not touch its surface."""
    if k == j or (boxes[k, 0] <= boxes[j, 0]).any() or (boxes[k, 1] >= boxes[j, 1]).any():
        return False
    if (pieces[k] - pieces[j]).volume() > SAME_VOLUME * volumes[k]:
        return False
    area = pieces[k].surface_area() + pieces[j].surface_area()
    return (pieces[j] - pieces[k]).surface_area() > (1 - SAME_VOLUME) * area


def _add(pieces: list[manifold3d.Manifold]) -> manifold3d.Manifold:
    return manifold3d.Manifold.batch_boolean(pieces, manifold3d.OpType.Add)


def _words(count: int, fate: str) -> list[str]:
    return [f"{count} shell{'s are' if count > 1 else ' is'} {fate}"] if count else []
