"""A `Body`: one rigid solid, in metres, made of the triangles of a mesh.

V is always `(V, 3)` float64, F is `(F, 3)` int64 with outward-facing, counter-clockwise triangles.
"""

from __future__ import annotations

import atexit
import hashlib
import weakref
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import manifold3d
import numpy as np

from ..util.errors import MeshError
from ..util.numbering import numbered
from .repair import repair as mend
from .shells import to_manifold
from .wishes import NO_WISHES, Wishes

RESERVED = ("container", "world", "camera")  # nodes of a scene; an object of that name is a second one


@dataclass(frozen=True, eq=False)
class Body:
    """One rigid solid.

    name : the file's stem.
    vertices, faces : `(V, 3)`, `(F, 3)`, the surface exactly as given; this is what results are written with.
    solid_vertices, solid_faces : the same body as one closed surface without inner faces, moved so that its
        bounding box is centred on the origin; everything is computed with this one.
    centre : `(3,)`, where that origin lies in the coordinates of `vertices`. Poses turn bodies about it.
    volume : cubic metres, of the solid.
    notes : what was done to the file's surface to make it one, a line each. source : the file it came from.
    wishes : how it may be turned, whether it must go in, and the like.
    core, growth : of a body that `growing.grown` made, the body inside it, and by how many metres it was grown.
    """

    name: str
    vertices: np.ndarray
    faces: np.ndarray
    solid_vertices: np.ndarray
    solid_faces: np.ndarray
    centre: np.ndarray
    volume: float
    notes: tuple[str, ...] = ()
    source: str = ""
    wishes: Wishes = NO_WISHES
    core: Body | None = None
    growth: float = 0.0

    @cached_property
    def digest(self) -> str:
        """Hash of the solid's geometry; equal for equal bodies, whatever their names."""
        data = self.solid_vertices.astype("<f8").tobytes() + self.solid_faces.astype("<i8").tobytes()
        return hashlib.sha256(data).hexdigest()

    @property
    def grown(self) -> bool:
        """Whether what counts is that the body inside keeps clear of others, see `growing.grown`."""
        return self.growth > 0

    @property
    def inside(self) -> Body:
        """The body inside a grown one, else the body itself."""
        return self if self.core is None else self.core

    @property
    def taken(self) -> float:
        """Cubic metres that the solid takes, which is more than `volume` where it is grown."""
        return self.volume if self.core is None else float(self.manifold.volume())

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

    @property
    def hull_corners(self) -> np.ndarray:
        """`(V, 3)` corners of the solid's convex hull, about the origin."""
        return np.asarray(self.manifold.hull().to_mesh64().vert_properties)[:, :3]

    def placed(self, matrix: np.ndarray) -> np.ndarray:
        """The solid's vertices `(V, 3)` where `matrix` `(4, 4)`, from file coordinates to the world, puts them."""
        return (self.solid_vertices + self.centre) @ matrix[:3, :3].T + matrix[:3, 3]

    def scaled(self, factor: float) -> Body:
        """The body with every length multiplied by `factor`."""
        lengths = {key: getattr(self, key) * factor for key in ("vertices", "solid_vertices", "centre")}
        core = None if self.core is None else self.core.scaled(factor)
        return replace(self, **lengths, volume=self.volume * factor**3, core=core, growth=self.growth * factor)

    def simplified(self, stray: float) -> Body:
        """The body with a surface of fewer triangles that strays by so many metres at most; `volume` is as it was."""
        mesh = self.manifold.simplify(stray).to_mesh64()
        vertices, faces = np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, np.int64)
        return replace(self, solid_vertices=vertices, solid_faces=faces)

    def moved(self, shift: np.ndarray) -> Body:
        """The body `shift` `(3,)` metres from where its file has it."""
        core = None if self.core is None else self.core.moved(shift)
        return replace(self, vertices=self.vertices + shift, centre=self.centre + shift, core=core)


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


def make_body(name: str, vertices: np.ndarray, faces: np.ndarray, repair: str = "close") -> Body:
    """A `Body` from any triangle soup that is closed, or can be closed.

    vertices `(V, 3)` in metres, faces `(F, 3)`. repair : "none", "close" or "wrap", see `repair.repair`.

    Raises MeshError naming `name` if there is nothing to work with: no faces, rows of other than three numbers,
    coordinates that are not finite, an open surface that cannot be closed, no volume.
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
    try:
        made = mend(vertices, faces, repair)
    except MeshError as error:
        raise MeshError(f"{name}: {error}") from error
    return _body(name, made.vertices, made.faces, made.solid, made.notes, size)


def _body(name: str, vertices, faces, solid: manifold3d.Manifold, notes: Sequence[str], size: float) -> Body:
    volume = solid.volume()
    if volume <= 1e-9 * size**3:
        raise MeshError(f"{name}: encloses no volume; a solid is needed, not a sheet")
    data = solid.to_mesh64()
    points = np.asarray(data.vert_properties)[:, :3].astype(np.float64)
    centre = (points.max(0) + points.min(0)) / 2
    corners = np.asarray(data.tri_verts, np.int64)
    return Body(name, vertices, faces, points - centre, corners, centre, float(volume), notes=tuple(notes))


def body_of_solid(body: Body, solid: manifold3d.Manifold, notes: Sequence[str]) -> Body:
    """`body` with the surface of a solid in its file's coordinates. Raises MeshError if that is empty."""
    data = solid.to_mesh64()
    vertices = np.array(np.asarray(data.vert_properties)[:, :3], np.float64)
    faces = np.array(data.tri_verts, np.int64)
    return _body(body.name, vertices, faces, solid, notes, 2 * body.half_extents.max())


def unique_names(bodies: Sequence[Body]) -> list[Body]:
    """The bodies with `#2`, `#3`, ... added to names that came before, or that a scene keeps for itself."""
    seen = dict.fromkeys(RESERVED, 1)
    named = []
    for body in bodies:
        stem, _ = numbered(body.name)
        seen[stem] = seen.get(stem, 0) + 1
        name = stem if seen[stem] == 1 else f"{stem}#{seen[stem]}"
        named.append(body if name == body.name else replace(body, name=name))
    return named


def named_apart(bodies: Sequence[Body], others: Sequence[Body]) -> list[Body]:
    """The bodies, with higher numbers than others have where their names are the same but for numbers."""
    highest: dict[str, int] = {}
    for body in others:
        stem, number = numbered(body.name)
        highest[stem] = max(number, highest.get(stem, 0))
    split = [(body, *numbered(body.name)) for body in bodies]
    return [
        replace(body, name=f"{stem}#{number + highest[stem]}") if stem in highest else body
        for body, stem, number in split
    ]
