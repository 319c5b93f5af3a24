"""Mesh files and folders of them -> bodies: units, parts of a file, names."""

from __future__ import annotations

import unicodedata
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import manifold3d
import numpy as np
from scipy.sparse.csgraph import connected_components

from ..io import mesh_files
from ..io.parts import FilePart, joined
from ..util.errors import InputError, MeshError, MeshWarning
from ..util.progress import progress_bar
from .meshes import Body, body_of_solid, make_body, unique_names
from .repair import REPAIRS

MESH_SUFFIXES = tuple(mesh_files.READERS)
PIECES_AS_OBJECTS = (".obj", ".stl")  # formats in which pieces of one thing are written as objects
PIECES_APART = 0.02  # of the file's longest edge: how far their boxes are apart at most
SHARED = 1e-3  # of the volume of parts: what they may share when united, as they do by rounding, without a word
MANY_FILES = 20  # from which on reading shows its progress
UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "inch": 0.0254}  # metres


@dataclass(frozen=True)
class Reading:
    """How mesh files are read.

    unit : what the numbers of a file mean that does not say so itself (STL, OBJ, OFF, PLY): mm, cm, m, inch.
    repair : "none", "close" or "wrap", as `repair.repair` has it. together : a file of several parts is one object.
    split : pieces of a file that do not touch are objects of their own.

    Raises InputError for other words, and for together and split at once.
    """

    unit: str = "m"
    repair: str = "close"
    together: bool = False
    split: bool = False

    @property
    def metres(self) -> float:
        """The length of the unit."""
        return UNITS[self.unit]

    def __post_init__(self):
        if self.unit not in UNITS:
            raise InputError(f"unit must be one of {', '.join(UNITS)}, got {self.unit!r}")
        if self.repair not in (*REPAIRS, "cap"):
            raise InputError(f"repair must be one of {', '.join(REPAIRS)}, got {self.repair!r}")
        if self.together and self.split:
            raise InputError("together keeps a file as one object, split parts it; give one of them")


METRES = Reading()


def load_body(path: str | Path, reading: Reading = METRES) -> Body:
    """Read one mesh file into one `Body` named by its stem, whatever parts it has. Raises MeshError naming the file."""
    return load_parts(path, replace(reading, together=True, split=False))[0]


def load_parts(path: str | Path, reading: Reading = METRES) -> list[Body]:
    """The solids of one mesh file: .obj .stl .ply .off .glb .3mf.

    Build items of a 3MF, nodes of a GLB, objects of an OBJ and solids of an ASCII STL are bodies of their own, named
    `<stem>.<part>`; the only one of a file has the file's stem. Objects of an OBJ and solids of an STL that lie close
    to each other are one body: decompositions into convex pieces are written so. Parts that bound no solid alone, but
    do together, are one body, too. Raises MeshError naming the file.
    """
    path = Path(path)
    if path.suffix.lower() not in MESH_SUFFIXES:
        raise MeshError(f"{path}: not a mesh file; use one of {' '.join(MESH_SUFFIXES)}")
    file = mesh_files.load(path)
    metres = reading.metres if file.metres is None else file.metres
    parts = [_scaled(part, metres) for part in file.parts]
    if path.suffix.lower() in PIECES_AS_OBJECTS:
        parts = _hanging_together(parts)
    try:
        bodies = [_solid_part(str(path), part, reading) for part in parts]
        if reading.together and len(bodies) > 1:
            bodies = [_joined(bodies)]
    except MeshError as alone:
        if len(parts) == 1 or any(part.cuts for part in parts):
            raise
        vertices, faces = joined([(part.vertices, part.faces) for part in parts])
        try:
            bodies = [make_body(str(path), vertices, faces, "none")]
        except MeshError:
            raise alone from None
        if not reading.together:
            note = f"{len(parts)} parts that are open alone are closed together, and kept as one"
            bodies = [replace(bodies[0], notes=(*bodies[0].notes, note))]
    if reading.split:
        bodies = [piece for body in bodies for piece in _pieces(body)]
    elif not reading.together:
        bodies = [_told_of_pieces(body) for body in bodies]
    for note in dict.fromkeys((*file.notes, *(note for body in bodies for note in body.notes))):
        warnings.warn(f"{path}: {note}", MeshWarning, stacklevel=2)
    stem = _tidy(path.stem)
    if len(bodies) == 1:
        names = [stem]
    elif len(bodies) == len(parts):
        names = [f"{stem}.{_tidy(part.name) or k + 1}" for k, part in enumerate(parts)]
    else:
        names = [f"{stem}.{k + 1}" for k in range(len(bodies))]
    return [
        replace(body, name=name, source=str(path), notes=(*file.notes, *body.notes))
        for body, name in zip(bodies, names, strict=True)
    ]


def load_bodies(sources: Iterable[str | Path], reading: Reading = METRES, progress: bool = False) -> list[Body]:
    """Read files and folders of meshes, in sorted order within a folder; hidden files there are not read.

    Raises MeshError for a file that cannot be used, InputError for a folder without meshes or no sources.
    """
    paths: list[Path] = []
    for source in map(Path, sources):
        if source.is_dir():
            found = sorted(
                path
                for path in source.iterdir()
                if path.suffix.lower() in MESH_SUFFIXES and not path.name.startswith(".") and not path.is_dir()
            )
            if not found:
                raise InputError(f"{source}: no mesh files in this folder; use {' '.join(MESH_SUFFIXES)}")
            paths += found
        else:
            paths.append(source)
    if not paths:
        raise InputError("no objects given; name mesh files or folders of them")
    with progress_bar("read", "file", progress and len(paths) > MANY_FILES, len(paths)) as bar:
        bodies: list[Body] = []
        for path in paths:
            bodies += load_parts(path, reading)
            bar.update()
    return unique_names(bodies)


def _tidy(name: str) -> str:
    """A name in one Unicode form, without the sign that numbers copies."""
    return unicodedata.normalize("NFC", name).replace("#", "_").strip()


def _hanging_together(parts: Sequence[FilePart]) -> list[FilePart]:
    """Parts whose boxes meet, or nearly, as one each; in the order of their first."""
    if len(parts) < 2:
        return list(parts)
    labels = _nearby(np.array([[part.vertices.min(0), part.vertices.max(0)] for part in parts]))
    found = []
    for label in dict.fromkeys(labels.tolist()):
        own = [parts[k] for k in np.flatnonzero(labels == label)]
        vertices, faces = joined([(part.vertices, part.faces) for part in own])
        found.append(replace(own[0], vertices=vertices, faces=faces))
    return found


def _nearby(boxes: np.ndarray) -> np.ndarray:
    """A label `(N,)` for each of boxes `(N, 2, 3)`, equal for those that meet, or nearly, at once or by others."""
    near = PIECES_APART * float(np.ptp(boxes.reshape(-1, 3), axis=0).max())
    below = (boxes[:, None, 0] <= boxes[None, :, 1] + near).all(-1)
    return connected_components(below & below.T, directed=False)[1]


def _scaled(part: FilePart, metres: float) -> FilePart:
    if metres == 1:
        return part
    cuts = tuple((vertices * metres, faces) for vertices, faces in part.cuts)
    return replace(part, vertices=part.vertices * metres, cuts=cuts)


def _solid_part(path: str, part: FilePart, reading: Reading) -> Body:
    body = make_body(f"{path}: {part.name}" if part.name else path, part.vertices, part.faces, reading.repair)
    if not part.cuts:
        return body
    solid = body.manifold.translate(body.centre)
    for vertices, faces in part.cuts:
        cut = make_body(f"{path}: a negative volume", vertices, faces, reading.repair)
        solid -= cut.manifold.translate(cut.centre)
    return body_of_solid(body, solid, (*body.notes, f"{len(part.cuts)} negative volumes cut away"))


def _joined(bodies: Sequence[Body]) -> Body:
    """Several bodies of one file as one, united where they overlap."""
    solid = manifold3d.Manifold.batch_boolean(
        [body.manifold.translate(body.centre) for body in bodies], manifold3d.OpType.Add
    )
    vertices, faces = joined([(body.vertices, body.faces) for body in bodies])
    notes = [note for body in bodies for note in body.notes]
    shared = 1 - solid.volume() / sum(body.volume for body in bodies)
    if shared > SHARED:
        notes.append(f"{len(bodies)} parts that overlap by {shared:.1%} of their volume are united")
    return replace(body_of_solid(bodies[0], solid, notes), vertices=vertices, faces=faces)


def _told_of_pieces(body: Body) -> Body:
    """The body, with a note if pieces of it lie apart."""
    pieces = body.manifold.decompose()
    apart = 1 + _nearby(np.array([piece.bounding_box() for piece in pieces]).reshape(-1, 2, 3)).max(initial=0)
    if apart < 2:
        return body
    return replace(
        body, notes=(*body.notes, f"{apart} pieces that lie apart are kept as one object; --split parts them")
    )


def _pieces(body: Body) -> list[Body]:
    """The pieces of a body that do not touch each other."""
    pieces = body.manifold.translate(body.centre).decompose()
    return [body] if len(pieces) == 1 else [body_of_solid(body, piece, body.notes) for piece in pieces]
