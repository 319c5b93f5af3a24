"""STL: triangles without vertices in common, binary or as text, in the dialects that are about."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator

import numpy as np

from ..util.errors import MeshError
from .parts import FilePart, MeshFile
from .polygons import triangulated
from .text import decoded, floats

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
# the words of one facet with three corners, and where they stand
WORDS = {0: "facet", 1: "normal", 5: "outer", 6: "loop", 7: "vertex", 11: "vertex", 15: "vertex", 19: "endloop"}
WORDS |= {20: "endfacet"}
# what follows the word solid: a name to the end of the line, or to a facet on the same line
NAME = re.compile(r"[ \t]*([^\n]*?)[ \t]*(?=\n|\Z|\sfacet\s+normal\s|\sendsolid\b)")
FACET = re.compile(r"\bfacet\b(.*?)(\bendfacet\b|(?=\bfacet\b)|\Z)", re.DOTALL)
VERTEX = re.compile(r"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)")


def parse(data: bytes) -> MeshFile:
    """The parts of an STL; `solid` blocks are parts of their own.

    Binary where the triangles that bytes 80 to 84 promise fit into the file, which no text of a size that is read can
    look like. Raises MeshError where triangles are missing, cut off, or written with decimal commas.
    """
    solids, rest = _binary(data)
    if solids:
        notes = [f"{rest} bytes after the last triangle are left out"] if rest else []
        return MeshFile(tuple(_part("", one["corners"].astype(np.float64)) for one in solids), None, tuple(notes))
    if b"\0" in data[:1024] and not data.startswith((b"\xff\xfe", b"\xfe\xff")):  # no text in any encoding but UTF-16
        if len(data) < 84:
            raise MeshError("holds no triangles, and is no STL; export the mesh again")
        count, room = struct.unpack("<I", data[80:84])[0], (len(data) - 84) // 50
        if count:
            raise MeshError(f"its header promises {count} triangles, but there are bytes for {room}; export it again")
        raise MeshError(f"holds no triangles by its header, and bytes for {room}; export the mesh again")
    return _text(decoded(data))


def _binary(data: bytes) -> tuple[list[np.ndarray], int]:
    """The solids of a binary STL, of which several may follow each other, and the bytes that remain."""
    found, at = [], 0
    while len(data) - at >= 84:
        count = struct.unpack_from("<I", data, at + 80)[0]
        if count == 0 or at + 84 + 50 * count > len(data):
            break
        found.append(np.frombuffer(data, TRIANGLE, count, at + 84))
        at += 84 + 50 * count
    if len(found) > 1 and at < len(data):  # what follows is no chain of solids: take it for other bytes
        at = 84 + 50 * len(found[0])
        found = found[:1]
    return found, len(data) - at


def _part(name: str, corners: np.ndarray) -> FilePart:
    """A part of triangles `(F, 3, 3)`."""
    return FilePart(name, corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


def _text(text: str) -> MeshFile:
    low = text.encode("ascii", "replace").decode().lower()  # a character each, so that places agree
    parts, at, closed = [], 0, False
    heads = [*_heads(low), (len(low), len(low), False)]
    name = ""
    for start, end, closes in heads:
        corners = _facets(low[at:start])
        if len(corners):
            parts.append(_part(name, corners))
        found = NAME.match(low, end)
        name, at = "", end
        if found:
            name, at = "" if closes else text[found.start(1) : found.end(1)], found.end()
        closed = closes if start < len(low) else closed
    if not parts:
        raise MeshError("holds no triangles; export it as a triangle mesh")
    return MeshFile(tuple(parts), None, () if closed else ("has no endsolid line at its end; it may be cut off",))


def _heads(low: str) -> Iterator[tuple[int, int, bool]]:
    """Where the words solid and endsolid begin and end, and whether it is the latter; names may have such words too."""
    at = low.find("solid")
    while at >= 0:
        end = at + 5
        closes = re.search(r"(?<!\S)end[ \t]*\Z", low[max(at - 20, 0) : at])
        start = at - len(closes[0]) if closes else at
        if (start == 0 or low[start - 1].isspace()) and (end == len(low) or low[end].isspace()):
            yield start, end, closes is not None
            found = NAME.match(low, end)
            end = found.end() if found else end
        at = low.find("solid", end)


def _facets(text: str) -> np.ndarray:
    """The triangles `(F, 3, 3)` of one solid's text in small letters."""
    words = text.split()
    count, rest = divmod(len(words), 21)
    if rest == 0 and all(words[at::21] == [name] * count for at, name in WORDS.items()):
        columns = [floats(words[7 + 4 * corner + axis :: 21]) for corner in range(3) for axis in (1, 2, 3)]
        return np.stack(columns, -1).reshape(-1, 3, 3)
    text = re.sub(r"\bend (?=facet|loop)", "end", " ".join(words))
    # facets with other numbers of corners, or without a normal, one by one
    numbers: list[str] = []
    counts = []
    for k, facet in enumerate(FACET.finditer(text)):
        corners = VERTEX.findall(facet[1])
        if not facet[2]:
            raise MeshError(f"is cut off in its facet {k + 1}; export the mesh again")
        if len(corners) < 3 or len(corners) != len(re.findall(r"\bvertex\b", facet[1])):
            raise MeshError(f"its facet {k + 1} has no three corners of three numbers; export the mesh again")
        counts.append(len(corners))
        numbers += [number for corner in corners for number in corner]
    vertices = floats(numbers).reshape(-1, 3)
    return vertices[triangulated(vertices, np.array(counts, np.int64), np.arange(len(vertices)))]
