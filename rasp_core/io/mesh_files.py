"""Mesh files from elsewhere, held to bounds before a reader sees them: what a file promises must fit into its bytes.

Readers believe headers. A header can promise more than there is, a compressed file can unfold to any size, scenes can
name themselves or multiply their parts at every level, and materials can name files anywhere on the disk. All that is
refused here, in time and memory in proportion to the file; readers are given bytes and no way to other files.
"""

from __future__ import annotations

import io
import json
import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import trimesh

from ..util.errors import MeshError

MAX_BYTES = 256 * 2**20  # of a file, and of what it unfolds to
MAX_TRIANGLES = 1_000_000  # of one body
MAX_ENTRIES = 1000  # files in a .3mf
MAX_NODES = 20_000  # of a scene, its repeated parts counted each time
HEADER_BYTES = 64 * 2**10


def read(path: Path) -> bytes:
    """The bytes of a mesh file that keeps to the bounds.

    Raises MeshError naming the file where it cannot be read, is too large, promises more than it holds, contains
    itself, or names other files.
    """
    try:
        if not path.is_file():  # a folder, or a device that never ends
            raise MeshError(f"{path}: no such file; check the path")
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise MeshError(f"{path}: has {size >> 20} MiB, more than {MAX_BYTES >> 20}; simplify the mesh")
        data = path.read_bytes()
    except MeshError:
        raise
    except (OSError, ValueError) as error:
        words = getattr(error, "strerror", None) or str(error)
        raise MeshError(f"{path}: cannot be read ({words}); check the path") from error
    check = CHECKS.get(path.suffix.lower())
    if check is not None:
        try:
            check(data)
        except MeshError as error:
            raise MeshError(f"{path}: {error}; export the mesh again") from error
    return data


def load(path: Path) -> trimesh.Scene:
    """The scene that a mesh file holds. Raises MeshError as `read` does, and where its reader finds no sense in it."""
    data = read(path)
    try:
        scene = trimesh.load_scene(io.BytesIO(data), file_type=path.suffix[1:].lower(), process=False)
        check_triangles(sum(len(scene.geometry[scene.graph[node][1]].faces) for node in scene.graph.nodes_geometry))
    except MeshError as error:
        raise MeshError(f"{path}: {error}; simplify the mesh") from error
    except Exception as error:  # trimesh's readers raise whatever their parsers raise
        words = " ".join(str(error).split())[:120] or type(error).__name__
        raise MeshError(f"{path}: cannot be read as a mesh ({words}); export it again") from error
    return scene


def check_triangles(count: int) -> None:
    """Raise MeshError where a body has more than `MAX_TRIANGLES`."""
    if count > MAX_TRIANGLES:
        raise MeshError(f"has {count:,} triangles, more than {MAX_TRIANGLES:,}")


def _check_counts(data: bytes, counts: Iterable[int], least: int = 1) -> None:
    """Each of the things that a header counts takes `least` bytes at least."""
    for count in counts:
        if not 0 <= count * least <= len(data):
            raise MeshError(f"its header promises {count} rows, which {len(data)} bytes cannot hold")


def _check_stl(data: bytes) -> None:
    if len(data) >= 84 and not data.lstrip().startswith(b"solid"):
        _check_counts(data, struct.unpack("<I", data[80:84]), least=50)


def _check_ply(data: bytes) -> None:
    header = data[:HEADER_BYTES].split(b"end_header")[0]
    _check_counts(data, map(int, re.findall(rb"^\s*element\s+\S+\s+(-?\d{1,20})\b", header, re.MULTILINE)))


def _check_off(data: bytes) -> None:
    text = re.sub(rb"#[^\n]*", b"", data[:HEADER_BYTES])
    found = re.match(rb"\s*OFF\s+(-?\d{1,20})\s+(-?\d{1,20})", text)
    if found:
        _check_counts(data, map(int, found.groups()))


def _check_glb(data: bytes) -> None:
    """Of a GLB's JSON: no files elsewhere, no array that its bytes cannot hold, no endless scene."""
    if len(data) < 20 or data[:4] != b"glTF":
        raise MeshError("is no GLB")
    length = struct.unpack("<I", data[12:16])[0]
    try:
        tree = json.loads(data[20 : 20 + length])
        arrays = tree.get("accessors", [])
        for part in (*tree.get("buffers", []), *tree.get("images", [])):
            if "uri" in part and not str(part["uri"]).startswith("data:"):
                raise MeshError(f"names another file, {str(part['uri'])[:60]!r}")
        for array in arrays:
            if "sparse" in array or "bufferView" not in array:
                raise MeshError("has sparse arrays, which are not read")
        _check_counts(data, (int(array["count"]) for array in arrays))
        sizes = [sum(_triangles(part, arrays) for part in mesh["primitives"]) for mesh in tree.get("meshes", [])]
        nodes = tree.get("nodes", [])
        children = {i: list(node.get("children", [])) for i, node in enumerate(nodes)}
        weights = {i: sizes[node["mesh"]] if "mesh" in node else 0 for i, node in enumerate(nodes)}
        for scene in tree.get("scenes", []):
            _check_scene(scene.get("nodes", []), children, weights)
    except MeshError:
        raise
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, RecursionError) as error:
        raise MeshError("its GLB header makes no sense") from error


def _triangles(part: Mapping, arrays: list) -> int:
    which = part["indices"] if "indices" in part else part["attributes"]["POSITION"]
    return int(arrays[which]["count"]) // 3


def _check_3mf(data: bytes) -> None:
    """Of a 3MF's archive: what it unfolds to, the places of its files, and its objects made of objects."""
    from lxml import etree

    options = {"resolve_entities": False, "no_network": True, "load_dtd": False, "huge_tree": False}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            entries = archive.infolist()
            unfolded = sum(entry.file_size for entry in entries)
            if len(entries) > MAX_ENTRIES or unfolded > MAX_BYTES:
                raise MeshError(f"unfolds to {len(entries)} files of {unfolded >> 20} MiB, more than is read")
            for entry in entries:
                if entry.filename.startswith(("/", "\\")) or ".." in Path(entry.filename).parts:
                    raise MeshError(f"holds a file that climbs out of its folder, {entry.filename[:60]!r}")
            children: dict[str, list[str]] = {}
            weights: dict[str, int] = {}
            first: list[str] = []
            for entry in entries:
                if not entry.filename.lower().endswith(".model"):
                    continue
                with archive.open(entry) as file:
                    tags = ("{*}object", "{*}build")
                    for _, part in etree.iterparse(io.BytesIO(file.read(MAX_BYTES)), tag=tags, **options):
                        if part.tag.endswith("build"):
                            first += [item.get("objectid", "") for item in part.iter("{*}item")]
                        else:
                            name = part.get("id", "")
                            made_of = [one.get("objectid", "") for one in part.iter("{*}component")]
                            children[name] = children.get(name, []) + made_of
                            weights[name] = weights.get(name, 0) + sum(1 for _ in part.iter("{*}triangle"))
                        part.clear()
    except MeshError:
        raise
    except (zipfile.BadZipFile, zipfile.LargeZipFile, etree.XMLSyntaxError) as error:
        raise MeshError("is no 3MF") from error
    except (OSError, EOFError, RuntimeError, ValueError, zlib.error) as error:
        raise MeshError("its archive is damaged") from error
    _check_scene(first, children, weights)


def _check_scene(first: Iterable, children: Mapping, weights: Mapping) -> None:
    """Walk a scene whose parts may be used again and again: no part within itself, and no more than is read."""
    nodes = triangles = 0
    waiting = [(node, 0) for node in first]
    while waiting:
        node, depth = waiting.pop()
        nodes, triangles = nodes + 1, triangles + weights.get(node, 0)
        if depth > len(children):
            raise MeshError("has a part that contains itself")
        if nodes > MAX_NODES:
            raise MeshError(f"has more than {MAX_NODES:,} parts")
        check_triangles(triangles)
        waiting += [(child, depth + 1) for child in children.get(node, [])]


CHECKS: dict[str, Callable[[bytes], None]] = {
    ".stl": _check_stl,
    ".ply": _check_ply,
    ".off": _check_off,
    ".glb": _check_glb,
    ".3mf": _check_3mf,
}
