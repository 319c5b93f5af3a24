"""PLY: a header that describes rows of numbers, which follow as text or as bytes of either order."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

from ..util.errors import MeshError
from .bounds import HEADER_BYTES, check_rows
from .parts import FilePart, MeshFile
from .polygons import told_triangles
from .text import floats

TYPES = {
    **{"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2"},
    **{"ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4"},
    **{"long": "i8", "int64": "i8", "ulong": "u8", "uint64": "u8"},
    **{"float": "f4", "float32": "f4", "double": "f8", "float64": "f8"},
}
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
FACES = ("vertex_indices", "vertex_index")


@dataclass
class Element:
    """A kind of row. properties : name -> (type of a list's count or "", type), types as numpy has them."""

    name: str
    count: int
    properties: dict[str, tuple[str, str]] = field(default_factory=dict)


# of one element, a column each: numbers (rows,), or a list's counts (rows,) and its numbers one after the other
Table = dict[str, tuple[np.ndarray, np.ndarray]]


def parse(data: bytes) -> MeshFile:
    """The one part of a PLY; triangle strips are read too. Raises MeshError where it is cut off, or has no faces."""
    order, elements, body = _header(data)
    check_rows(data, (element.count for element in elements))
    tables = _read_text(body, elements) if order == "" else _read_bytes(body, elements, order)
    points = tables.get("vertex", {})
    if not all(axis in points for axis in "xyz"):
        raise MeshError("its vertices have no x, y and z; export the mesh again")
    vertices = np.stack([points[axis][1].astype(np.float64) for axis in "xyz"], -1)
    counts, corners = _faces(tables)
    if not len(counts):
        if len(vertices):
            raise MeshError("is a point cloud, it has no faces; make a mesh of it")
        raise MeshError("holds no triangles; export it as a triangle mesh")
    faces, notes = told_triangles(vertices, counts, corners)
    return MeshFile((FilePart("", vertices, faces),), None, notes)


def _header(data: bytes) -> tuple[str, list[Element], bytes]:
    """Byte order ("" for text), elements, and the bytes after the header."""
    # where lines end in \r alone, a \n after the last one belongs to the numbers; else both are about in one header
    found = re.match(
        rb"(?:\xef\xbb\xbf)?\s*ply[ \t]*(?:\r(?!\n)(.*?)end_header[ \t]*\r|\r?\n(.*?)end_header[ \t]*\r?\n)",
        data[:HEADER_BYTES],
        re.DOTALL,
    )
    if not found:
        whole = re.match(rb"(?:\xef\xbb\xbf)?\s*ply\b", data)
        raise MeshError("its header has no end; export the mesh again" if whole else "is no PLY; export the mesh again")
    order, elements = None, []
    for words in map(str.split, re.split(r"[\r\n]+", (found[1] or found[2] or b"").decode("latin-1"))):
        try:
            if words[:1] == ["format"]:
                order = ORDERS[words[1]]
            elif words[:1] == ["element"]:
                elements.append(Element(words[1], int(words[2])))
            elif words[:2] == ["property", "list"]:
                elements[-1].properties[words[4]] = TYPES[words[2]], TYPES[words[3]]
            elif words[:1] == ["property"]:
                elements[-1].properties[words[2]] = "", TYPES[words[1]]
        except (KeyError, IndexError, ValueError) as error:
            line = " ".join(words)[:60]
            raise MeshError(f"its header line {line!r} makes no sense; export the mesh again") from error
    if order is None:
        raise MeshError("its header names no format; export the mesh again")
    return order, elements, data[found.end() :]


def _faces(tables: dict[str, Table]) -> tuple[np.ndarray, np.ndarray]:
    """Corners of each face, and all corners one after the other."""
    nothing = np.empty(0, np.int64)
    for name in FACES:
        if name in tables.get("face", {}):
            counts, corners = tables["face"][name]
            return counts, _whole(corners)
    if "face" in tables and len(next(iter(tables["face"].values()), (nothing, nothing))[0]):
        raise MeshError("its faces have no vertex_indices; export the mesh again")
    for name in FACES:
        if name in tables.get("tristrips", {}):
            strips = _whole(tables["tristrips"][name][1])
            return _strips(strips)
    return nothing, nothing


def _strips(words: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of strips `(N,)` that a -1 ends; every second triangle of a strip is turned."""
    three = np.stack([words[:-2], words[1:-1], words[2:]], -1) if len(words) > 2 else np.empty((0, 3), np.int64)
    ends = np.flatnonzero(words == -1)
    first = np.concatenate([[0], ends + 1])
    place = np.arange(len(three)) - first[np.searchsorted(ends, np.arange(len(three)))]
    three[place % 2 == 1] = three[place % 2 == 1][:, [1, 0, 2]]
    sound = (
        (three >= 0).all(1) & (three[:, 0] != three[:, 1]) & (three[:, 1] != three[:, 2]) & (three[:, 2] != three[:, 0])
    )
    three = three[sound]  # a corner twice only turns the strip
    return np.full(len(three), 3), three.ravel()


def _whole(numbers: np.ndarray) -> np.ndarray:
    whole = numbers.astype(np.int64) if (np.abs(numbers) < 2**53).all() else None  # NaN is not below either
    if whole is None or (whole != numbers).any():
        raise MeshError("its faces name vertices by numbers that are not whole; export the mesh again")
    return whole


def _cut_off(element: Element) -> MeshError:
    return MeshError(f"is cut off: it promises {element.count} of {element.name[:40]!r}; export the mesh again")


def _read_text(body: bytes, elements: list[Element]) -> dict[str, Table]:
    words = body.decode("latin-1").split()
    tables, at = {}, 0
    for element in elements:
        kinds = list(element.properties.values())
        if not any(count for count, _ in kinds):
            end = at + element.count * len(kinds)
            rows = floats(words[at:end])
            if end > len(words):
                raise _cut_off(element)
            rows = rows.reshape(element.count, len(kinds))
            columns = [(rows[:, k], rows[:, k]) for k in range(len(kinds))]
        else:
            columns, at = _text_rows(words, at, element)
            end = at
        tables.setdefault(element.name, dict(zip(element.properties, columns, strict=True)))
        at = end
    return tables


def _text_rows(words: list[str], at: int, element: Element) -> tuple[list[tuple[np.ndarray, np.ndarray]], int]:
    counts: list[list[int]] = [[] for _ in element.properties]
    numbers: list[list[str]] = [[] for _ in element.properties]
    listed = [bool(count) for count, _ in element.properties.values()]
    try:
        for _ in range(element.count):
            for k, one in enumerate(listed):
                size = int(words[at]) if one else 1
                at += one
                if size < 0 or at + size > len(words):
                    raise _cut_off(element)
                counts[k].append(size)
                numbers[k] += words[at : at + size]
                at += size
    except (IndexError, ValueError) as error:
        raise _cut_off(element) from error
    return [(np.array(n, np.int64), floats(found)) for n, found in zip(counts, numbers, strict=True)], at


def _read_bytes(body: bytes, elements: list[Element], order: str) -> dict[str, Table]:
    tables, at = {}, 0
    for element in elements:
        kinds = [(count and order + count, order + kind) for count, kind in element.properties.values()]
        columns, at = _equal_rows(body, at, element, kinds) or _byte_rows(body, at, element, kinds)
        tables.setdefault(element.name, dict(zip(element.properties, columns, strict=True)))
    return tables


def _equal_rows(body: bytes, at: int, element: Element, kinds: list[tuple[str, str]]):
    """The columns of rows that are all as long as the first, and where they end; None where they are not."""
    fields, sizes, here = [], [], at
    for k, (count, kind) in enumerate(kinds):
        size = 1
        if count:
            if here + np.dtype(count).itemsize > len(body):
                return None
            size = int(np.frombuffer(body, count, 1, here)[0])
            fields.append((f"n{k}", count))
            here += np.dtype(count).itemsize
        if not 0 <= size <= len(body):
            return None
        fields.append((str(k), kind, (size,)))
        sizes.append(size)
        here += size * np.dtype(kind).itemsize
    row = np.dtype(fields)
    if not row.itemsize or at + element.count * row.itemsize > len(body):
        return None
    rows = np.frombuffer(body, row, element.count, at)
    if any(count and (rows[f"n{k}"] != sizes[k]).any() for k, (count, _) in enumerate(kinds)):
        return None
    columns = [(np.full(element.count, sizes[k]), rows[str(k)].ravel()) for k in range(len(kinds))]
    return columns, at + element.count * row.itemsize


def _byte_rows(body: bytes, at: int, element: Element, kinds: list[tuple[str, str]]):
    """The columns of rows of any lengths, and where they end."""
    counts: list[list[int]] = [[] for _ in kinds]
    pieces: list[list[bytes]] = [[] for _ in kinds]
    plain = [(np.dtype(count) if count else None, np.dtype(kind)) for count, kind in kinds]
    big = "big" if any(kind.startswith(">") for _, kind in kinds) else "little"
    for _ in range(element.count if kinds else 0):
        for k, (count, kind) in enumerate(plain):
            size = 1
            if count is not None:
                head = body[at : at + count.itemsize]
                size = int.from_bytes(head, big, signed=count.kind == "i") if count.kind in "iu" else -1
                at += count.itemsize
            end = at + size * kind.itemsize
            if size < 0 or end > len(body):
                raise _cut_off(element)
            counts[k].append(size)
            pieces[k].append(body[at:end])
            at = end
    columns = [np.frombuffer(b"".join(piece), kind) for piece, (_, kind) in zip(pieces, plain, strict=True)]
    return list(zip((np.array(n, np.int64) for n in counts), columns, strict=True)), at
