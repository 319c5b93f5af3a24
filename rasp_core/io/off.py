"""OFF: counts, vertices and polygons as a stream of numbers, with or without colours, normals, and the word OFF."""

from __future__ import annotations

import re

import numpy as np

from ..util.errors import MeshError
from .bounds import check_rows
from .parts import FilePart, MeshFile
from .polygons import told_triangles
from .text import decoded, floats, integers

EXTRAS = {"N": 3, "C": 4, "ST": 2}  # numbers after each vertex that the keyword's letters announce


def parse(data: bytes) -> MeshFile:
    """The one part of an OFF. Raises MeshError where its numbers do not add up, or it has no faces."""
    text = re.sub(r"#[^\n]*", "", decoded(data))
    word = re.match(r"\s*((?:ST|C|N|4|n)*OFF)(?:\s*BINARY)?", text)
    if word:
        if "BINARY" in word[0]:
            raise MeshError("is a binary OFF, which is not read; export it as text")
        if "4" in word[1] or "n" in word[1]:
            raise MeshError("has vertices of other than three coordinates; export it in three dimensions")
        text = text[word.end() :]
    elif re.match(r"\s*[^\s\d+-]", text):
        raise MeshError("is no OFF; export the mesh again")
    lines = [words for words in map(str.split, text.split("\n")) if words]
    words = [word for line in lines for word in line]
    given = 2 if lines and len(lines[0]) == 2 else 3  # some leave out the number of edges
    if len(words) < given:
        raise MeshError("is cut off before its counts; export the mesh again")
    vertex_count, face_count = (int(n) for n in integers(words[:given])[:2])
    check_rows(data, (vertex_count, face_count))
    if not face_count:
        raise MeshError(
            "is a point cloud, it has no faces; make a mesh of it" if vertex_count else "holds no triangles"
        )
    rows = _by_lines(lines, given, vertex_count, face_count)
    if rows is None:
        rows = _by_words(words[given:], word[1] if word else "", vertex_count, face_count)
    vertices, counts, corners = rows
    faces, notes = told_triangles(vertices, counts, corners)
    return MeshFile((FilePart("", vertices, faces),), None, notes)


def _by_lines(lines: list[list[str]], given: int, vertex_count: int, face_count: int):
    """Vertices `(V, 3)`, corners of each face, all corners; None where vertices and faces have no lines of their own.

    Lines tell the colours of faces from the next face.
    """
    if len(lines[0]) != given or len(lines) != 1 + vertex_count + face_count:
        return None
    vertices, faces = lines[1 : 1 + vertex_count], lines[1 + vertex_count :]
    if len({len(line) for line in vertices}) > 1 or any(len(line) < 3 for line in vertices):
        return None
    if not all(line[0].isdecimal() and len(line) > int(line[0]) for line in faces):
        return None
    counts = integers([line[0] for line in faces])
    corners = integers([word for line in faces for word in line[1 : 1 + int(line[0])]])
    return floats([word for line in vertices for word in line[:3]]).reshape(-1, 3), counts, corners


def _by_words(words: list[str], keyword: str, vertex_count: int, face_count: int):
    """As `_by_lines` of a stream of words: no colours of faces."""
    width = 3 + sum(size for letters, size in EXTRAS.items() if letters in keyword[:-3])
    at = vertex_count * width
    vertices = [word for axis in range(3) for word in words[axis:at:width]]
    if len(vertices) < 3 * vertex_count:
        raise MeshError(f"is cut off: it promises {vertex_count} vertices and {face_count} faces; export it again")
    counts, corners = [], []
    for _ in range(face_count):
        size = int(integers(words[at : at + 1])[0]) if at < len(words) else -1
        if size < 0 or at + size >= len(words):
            raise MeshError(f"is cut off: it promises {face_count} faces, and {len(counts)} are there; export it again")
        counts.append(size)
        corners += words[at + 1 : at + 1 + size]
        at += 1 + size
    if at != len(words):
        raise MeshError(f"has {len(words) - at} numbers after its last face; export the mesh again")
    return floats(vertices).reshape(3, -1).T, np.array(counts, np.int64), integers(corners)
