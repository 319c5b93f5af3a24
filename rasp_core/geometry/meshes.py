"""Load meshes, close them, and turn each into a `Body`: one rigid solid, in metres.

V is always `(V, 3)` float64, F is `(F, 3)` int64 with outward-facing, counter-clockwise triangles.
"""

from __future__ import annotations

import atexit
import hashlib
import weakref
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import manifold3d
import numpy as np
import trimesh

from ..io import mesh_files
from ..util.errors import InputError, MeshError

MESH_SUFFIXES = (".obj", ".stl", ".ply", ".off", ".glb", ".3mf")


@dataclass(frozen=True, eq=False)
class Body:
    """One rigid solid.

    name : the file's stem.
    vertices, faces : `(V, 3)`, `(F, 3)`, the surface exactly as given; this is what results are written with.
    solid_vertices, solid_faces : the same body as one closed surface without inner faces, moved so that its
        bounding box is centred on the origin; everything is computed with this one.
    centre : `(3,)`, where that origin lies in the coordinates of `vertices`. Poses turn bodies about it.
    volume : cubic metres, of the solid.
    """

    name: str
    vertices: np.ndarray
    faces: np.ndarray
    solid_vertices: np.ndarray
    solid_faces: np.ndarray
    centre: np.ndarray
    volume: float

    @cached_property
    def digest(self) -> str:
        """Hash of the solid's geometry; equal for equal bodies, whatever their names."""
        data = self.solid_vertices.astype("<f8").tobytes() + self.solid_faces.astype("<i8").tobytes()
        return hashlib.sha256(data).hexdigest()

    @cached_property
    def half_extents(self) -> np.ndarray:
        """`(3,)`, half the edges of the solid's bounding box, which is centred on the origin."""
        return self.solid_vertices.max(0)

    @cached_property
    def radius(self) -> float:
        """Radius of the sphere about the origin that holds the solid."""
        return float(np.linalg.norm(self.solid_vertices, axis=1).max())

    @cached_property
    def manifold(self) -> manifold3d.Manifold:
        """The solid for exact booleans, centred on the origin."""
        _WITH_SOLID.add(self)
        return to_manifold(self.solid_vertices, self.solid_faces)

    def placed(self, matrix: np.ndarray) -> np.ndarray:
        """The solid's vertices `(V, 3)` where `matrix` `(4, 4)`, from file coordinates to the world, puts them."""
        return (self.solid_vertices + self.centre) @ matrix[:3, :3].T + matrix[:3, 3]

    def scaled(self, factor: float) -> Body:
        """The body with every length multiplied by `factor`."""
        lengths = {key: getattr(self, key) * factor for key in ("vertices", "solid_vertices", "centre")}
        return replace(self, **lengths, volume=self.volume * factor**3)


_WITH_SOLID: weakref.WeakSet[Body] = weakref.WeakSet()


@atexit.register
def _release_solids() -> None:
    """Bodies that something holds to the very end let go of their solids, which manifold3d would report as leaks."""
    for body in list(_WITH_SOLID):
        vars(body).pop("manifold", None)


class SolidKey:
    """A key for caches that is equal for bodies with equal solids, so that they share what is computed of them."""

    def __init__(self, body: Body):
        self.body = body

    def __hash__(self):
        return hash(self.body.digest)

    def __eq__(self, other):
        return self.body.digest == other.body.digest


def to_manifold(vertices: np.ndarray, faces: np.ndarray) -> manifold3d.Manifold:
    """`(V, 3)`, `(F, 3)` -> a manifold3d solid. Raises MeshError where the surface is not closed."""
    solid = manifold3d.Manifold(
        manifold3d.Mesh64(
            np.ascontiguousarray(vertices, np.float64).reshape(-1, 3),
            np.ascontiguousarray(faces, np.uint64).reshape(-1, 3),
        )
    )
    if solid.status() != manifold3d.Error.NoError:
        raise MeshError(f"the surface is not closed ({solid.status().name})")
    return solid


def is_closed(faces: np.ndarray) -> bool:
    """True where every directed edge of `(F, 3)` faces is met by as many opposite ones."""
    if len(faces) == 0:
        return False
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    n = int(faces.max()) + 1
    forward, backward = edges[:, 0] * n + edges[:, 1], edges[:, 1] * n + edges[:, 0]
    return bool(np.array_equal(np.sort(forward), np.sort(backward)))


def unite(vertices: np.ndarray, faces: np.ndarray) -> manifold3d.Manifold:
    """One solid from a closed surface of one or many pieces.

    Pieces that touch or overlap are united (Kitchen objects are sets of touching convex pieces); a piece that is
    inside out within others is a cavity and is taken away; a surface that is inside out as a whole is turned.

    Raises MeshError where a piece is not closed.
    """
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    labels = trimesh.graph.connected_component_labels(mesh.face_adjacency, node_count=len(faces))
    groups = np.split(faces[np.argsort(labels, kind="stable")], np.cumsum(np.bincount(labels))[:-1])
    pieces = [to_manifold(*_submesh(vertices, group)) for group in groups]
    if sum(piece.volume() for piece in pieces) < 0:
        return unite(vertices, faces[:, ::-1])
    solid = manifold3d.Manifold.batch_boolean([piece for piece in pieces if piece.volume() > 0], manifold3d.OpType.Add)
    for group, piece in zip(groups, pieces, strict=True):
        if piece.volume() < 0:
            solid -= to_manifold(*_submesh(vertices, group[:, ::-1]))
    return solid


def make_body(name: str, vertices: np.ndarray, faces: np.ndarray) -> Body:
    """A `Body` from any triangle soup that is closed, or can be closed.

    vertices `(V, 3)` in metres, faces `(F, 3)`. Raises MeshError naming `name` where there is nothing to work
    with: no faces, rows of other than three numbers, coordinates that are not finite, an open surface that cannot be
    closed, no volume.
    """
    # copies: arrays of manifold3d are windows into its own memory, which a body would keep
    vertices, faces = np.array(vertices, np.float64), np.array(faces, np.int64)
    if vertices.size % 3 or faces.size % 3:
        raise MeshError(f"{name}: vertices and faces need three numbers each; export it as a triangle mesh")
    vertices, faces = vertices.reshape(-1, 3), faces.reshape(-1, 3)
    if len(faces) == 0:
        raise MeshError(f"{name}: holds no triangles; export it as a triangle mesh")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise MeshError(f"{name}: faces name vertices that are not there; export the mesh again")
    if not np.isfinite(vertices[faces]).all():
        raise MeshError(f"{name}: has vertices that are NaN or infinite; repair the mesh or leave it out")
    size = float(np.ptp(vertices[faces].reshape(-1, 3), axis=0).max())
    if size == 0:
        raise MeshError(f"{name}: all its vertices are one point; leave it out")
    vertices, faces, solid = _close(name, vertices, faces)
    volume = solid.volume()
    if volume <= 1e-9 * size**3:
        raise MeshError(f"{name}: encloses no volume; a solid is needed, not a sheet")
    data = solid.to_mesh64()
    points = np.asarray(data.vert_properties)[:, :3].astype(np.float64)
    centre = (points.max(0) + points.min(0)) / 2
    return Body(name, vertices, faces, points - centre, np.asarray(data.tri_verts, np.int64), centre, float(volume))


def load_body(path: str | Path) -> Body:
    """Read one mesh file into a `Body` named by its stem.

    Formats: .obj .stl .ply .off .glb .3mf, lengths taken as metres. A scene is taken as one body.
    Raises MeshError naming the file.
    """
    path = Path(path)
    if path.suffix.lower() not in MESH_SUFFIXES:
        raise MeshError(f"{path}: not a mesh file; use one of {' '.join(MESH_SUFFIXES)}")
    mesh = mesh_files.load(path).to_mesh()
    return replace(make_body(str(path), mesh.vertices, mesh.faces), name=path.stem)


def load_bodies(sources: Iterable[str | Path]) -> list[Body]:
    """Read files and folders of meshes, in sorted order within a folder.

    Raises MeshError for a file that cannot be used, InputError for a folder without meshes or no sources.
    """
    paths: list[Path] = []
    for source in map(Path, sources):
        if source.is_dir():
            found = sorted(path for path in source.iterdir() if path.suffix.lower() in MESH_SUFFIXES)
            if not found:
                raise InputError(f"{source}: no mesh files in this folder; use {' '.join(MESH_SUFFIXES)}")
            paths += found
        else:
            paths.append(source)
    if not paths:
        raise InputError("no objects given; name mesh files or folders of them")
    return unique_names([load_body(path) for path in paths])


def unique_names(bodies: Sequence[Body]) -> list[Body]:
    """The bodies with `#2`, `#3`, ... added to names that came before."""
    seen: dict[str, int] = {}
    named = []
    for body in bodies:
        stem = body.name.split("#")[0]
        seen[stem] = seen.get(stem, 0) + 1
        name = stem if seen[stem] == 1 else f"{stem}#{seen[stem]}"
        named.append(body if name == body.name else replace(body, name=name))
    return named


def _close(name: str, vertices: np.ndarray, faces: np.ndarray):
    """The surface and its solid: as given, else welded, else repaired to its largest closed component."""
    tried = ""
    for attempt in (_as_given, _welded, _largest_closed):
        try:
            candidate = attempt(vertices, faces)
            if is_closed(candidate[1]):
                return *candidate, unite(*candidate)
        except MeshError as error:
            tried = f" ({error})"
    raise MeshError(f"{name}: the surface is open and could not be closed{tried}; close its holes in a mesh editor")


def _as_given(vertices, faces):
    return vertices, faces


def _welded(vertices, faces):
    """Equal vertices merged, degenerate and repeated faces dropped; the usual state of an STL file."""
    mesh = trimesh.Trimesh(vertices, faces, process=True)
    mesh.update_faces(mesh.nondegenerate_faces(height=0) & mesh.unique_faces())
    mesh.remove_unreferenced_vertices()
    trimesh.repair.fix_winding(mesh)
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def _largest_closed(vertices, faces):
    """Faces about edges with more than two faces dropped, holes filled, the largest closed piece kept."""
    mesh = trimesh.Trimesh(*_welded(vertices, faces), process=False)
    edges = mesh.edges_sorted
    _, inverse, counts = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    crowded = (counts[inverse.ravel()] > 2).reshape(-1, 3).any(1) if len(edges) else np.zeros(0, bool)
    mesh.update_faces(~crowded)
    mesh.fill_holes()
    trimesh.repair.fix_winding(mesh)
    pieces = [piece for piece in mesh.split(only_watertight=True) if is_closed(piece.faces)]
    if not pieces:
        return np.asarray(mesh.vertices), np.asarray(mesh.faces)
    largest = max(pieces, key=lambda piece: abs(piece.volume))
    return np.asarray(largest.vertices), np.asarray(largest.faces)


def _submesh(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    used, renumbered = np.unique(faces, return_inverse=True)
    return vertices[used], renumbered.reshape(-1, 3)
