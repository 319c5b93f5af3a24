"""OBJ: vertices and polygons a line each. Materials are not read, no other file is opened."""

from __future__ import annotations

import re

import numpy as np

from ..util.errors import MeshError
from .parts import FilePart, MeshFile, used_only
from .polygons import told_triangles
from .text import decoded, floats, integers

FREE_FORM = ("curv", "curv2", "surf", "bzp", "bsp", "cdc", "cdp")


def parse(data: bytes) -> MeshFile:
    """The parts of an OBJ: its objects (`o`), of which those of one name are one part. Groups (`g`) are none.

    Raises MeshError where it has no faces, or faces of what is not there.
    """
    text = re.sub(r"\\[ \t]*\n", " ", decoded(data))
    lines = [line.strip() for line in re.sub(r"#[^\n]*", "", text).replace("\t", " ").split("\n")]
    words = [line.partition(" ")[0] for line in lines]
    kinds = np.array(words or [""], "U8")  # longer words are none that is looked for
    vertex_lines, face_lines = np.flatnonzero(kinds == "v"), np.flatnonzero(kinds == "f")
    vertices = _vertices([lines[k] for k in vertex_lines])
    notes = []
    if not len(face_lines):
        _refuse(kinds, len(vertices))
    for name, which in (("lines", ("l",)), ("points", ("p",)), ("free-form curves and surfaces", FREE_FORM)):
        if len(face_lines) and (found := int(np.isin(kinds, which).sum())):
            notes.append(f"{found} {name} are left out")
    counts, corners = _corners([lines[k] for k in face_lines])
    before = np.searchsorted(vertex_lines, face_lines)  # negative numbers count back from there
    if (corners == 0).any():
        raise MeshError("faces name vertex 0, but OBJ counts from 1; export the mesh again")
    corners = np.where(corners < 0, corners + np.repeat(before, counts), corners - 1)
    faces, told = told_triangles(vertices, counts, corners)
    object_lines = np.flatnonzero(kinds == "o")
    names = ["", *(lines[k][1:].strip() for k in object_lines)]
    owner = np.repeat(np.searchsorted(object_lines, face_lines), np.maximum(counts - 2, 0))
    first = {name: k for k, name in reversed(list(enumerate(names)))}
    owner = np.array([first[name] for name in names])[owner]
    parts = tuple(FilePart(names[k], *used_only(vertices, faces[owner == k])) for k in np.unique(owner))
    return MeshFile(parts, None, (*notes, *told))


def _refuse(kinds: np.ndarray, count: int) -> None:
    if np.isin(kinds, FREE_FORM).any():
        raise MeshError("holds free-form curves or surfaces, no faces; export it as a triangle mesh")
    if np.isin(kinds, ("l", "p")).any():
        raise MeshError("holds lines and points only, no faces; export it as a triangle mesh")
    if count:
        raise MeshError("is a point cloud, it has no faces; make a mesh of it")
    raise MeshError("holds no triangles; export it as a triangle mesh")


def _vertices(lines: list[str]) -> np.ndarray:
    """`(V, 3)` of `v x y z` and whatever follows: a weight, a colour."""
    rows = [line.split()[1:4] for line in lines]
    if any(len(row) < 3 for row in rows):
        raise MeshError("has a vertex of fewer than three numbers; export the mesh again")
    return floats([number for row in rows for number in row]).reshape(-1, 3)


def _corners(lines: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Number of corners of each face, and the vertices that they name one after the other."""
    rows = [line.split()[1:] for line in re.sub(r"/[^\s]*", "", "\n".join(lines)).split("\n")] if lines else []
    return np.array([len(row) for row in rows], np.int64), integers([word for row in rows for word in row])
