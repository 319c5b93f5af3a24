"""Bounds that a mesh file is held to before a reader sees it: what it promises must fit into its bytes.

Headers can promise more than there is, a compressed file can unfold to any size, scenes can name themselves or multiply
their parts at every level, and materials can name files anywhere on the disk. All that is refused here, in time and
memory in proportion to the file. Every MeshError ends with what to do.
"""

from __future__ import annotations

import io
import json
import posixpath
import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Hashable, Iterable, Mapping
from pathlib import Path

from ..util.errors import MeshError
from .model_xml import ModelXml

MAX_BYTES = 256 * 2**20  # of a file, and of what it unfolds to
MAX_TRIANGLES = 1_000_000  # of one part
MAX_SCENE = 4  # as many times that in a file of several parts, its repeated parts counted each time
MAX_ENTRIES = 1000  # files in a .3mf
MAX_NODES = 20_000  # of a scene, its repeated parts counted each time
HEADER_BYTES = 64 * 2**10
PACKED = {
    "KHR_draco_mesh_compression": "Draco",
    "EXT_meshopt_compression": "meshopt",
    "KHR_meshopt_compression": "meshopt",
}


def check_triangles(count: int, times: int = 1) -> None:
    """Raise MeshError where there are more than `times` `MAX_TRIANGLES`."""
    if count > times * MAX_TRIANGLES:
        raise MeshError(
            f"has {count:,} triangles, more than {times * MAX_TRIANGLES:,}; simplify the mesh first, "
            "for example by open3d's simplify_quadric_decimation"
        )


def check_rows(data: bytes, counts: Iterable[int]) -> None:
    """Raise MeshError where a header counts more things than the file has bytes, or fewer than none."""
    for count in counts:
        if not 0 <= count <= len(data):
            raise MeshError(f"its header promises {count} rows, which {len(data)} bytes cannot hold; export it again")


def check_scene(first: Iterable, children: Mapping, triangles: Mapping, copies: Mapping | None = None) -> None:
    """Raise MeshError where a scene has a part within itself, or more parts or triangles than are read.

    first : the parts it begins with. children : those within each part, as often as they are used. triangles : of each
    part alone. copies : how often a part is there at each use, once if it is not named.
    """
    nodes = count = 0
    waiting = [(node, 0) for node in first]
    while waiting:
        node, depth = waiting.pop()
        times = (copies or {}).get(node, 1)
        nodes, count = nodes + times, count + times * triangles.get(node, 0)
        if depth > len(children):
            raise MeshError("has a part that contains itself; export the mesh again")
        if nodes > MAX_NODES:
            raise MeshError(f"has more than {MAX_NODES:,} parts; save fewer in a file")
        check_triangles(count, MAX_SCENE)
        waiting += [(child, depth + 1) for child in children.get(node, [])]


def glb_json(data: bytes) -> dict:
    """The JSON of a GLB. Raises MeshError where there is none."""
    if len(data) < 20 or data[:4] != b"glTF":
        raise MeshError("is no GLB; export the mesh again")
    version, length = struct.unpack_from("<I", data, 4)[0], struct.unpack_from("<I", data, 12)[0]
    if version != 2 or data[16:20] != b"JSON":
        raise MeshError(f"is a GLB of version {version}, only 2 is read; export the mesh again")
    try:
        tree = json.loads(data[20 : 20 + length])
    except (ValueError, RecursionError) as error:
        raise MeshError("its GLB header makes no sense; export the mesh again") from error
    if not isinstance(tree, dict):
        raise MeshError("its GLB header makes no sense; export the mesh again")
    return tree


def glb_roots(tree: dict) -> list[int]:
    """The nodes that the default scene begins with; those that lie in no other where there is no scene."""
    scenes, nodes = tree.get("scenes", []), tree.get("nodes", [])
    if scenes:
        return list(scenes[tree.get("scene", 0)].get("nodes", []))
    within = {child for node in nodes for child in node.get("children", [])}
    return [k for k in range(len(nodes)) if k not in within]


def glb_triangles(part: Mapping, arrays: list) -> int:
    """How many triangles a primitive has, 0 for points and lines."""
    which = part["indices"] if "indices" in part else part["attributes"]["POSITION"]
    count, mode = int(arrays[which]["count"]), part.get("mode", 4)
    return count // 3 if mode == 4 else max(count - 2, 0) if mode in (5, 6) else 0


def _check_glb(data: bytes) -> None:
    """Of a GLB's JSON: no files elsewhere, no array that its bytes cannot hold, no endless scene."""
    tree = glb_json(data)
    try:
        arrays = tree.get("accessors", [])
        for part in (*tree.get("buffers", []), *tree.get("images", [])):
            if "uri" in part and not str(part["uri"]).startswith("data:"):
                name = " ".join(str(part["uri"])[:60].split())
                raise MeshError(f"names another file, {name!r}, and none is opened; export it as one GLB")
        # before the counts, which compressed bytes need not hold; naming an extension is not using it
        users = [part for mesh in tree.get("meshes", []) for part in mesh["primitives"]] + tree.get("bufferViews", [])
        for name in {name for user in users for name in user.get("extensions", {})} & set(PACKED):
            raise MeshError(f"is compressed ({PACKED[name]}, {name}), which is not read; export it without compression")
        counts = [int(array["count"]) for array in arrays]
        sparse = [int(array["sparse"]["count"]) for array in arrays if "sparse" in array]
        virtual = any("bufferView" not in array for array in arrays)
        if virtual and max((*counts, *sparse), default=0) > len(data):
            raise MeshError(f"has sparse arrays of {max(counts)} rows, more than its bytes; export the mesh again")
        check_rows(data, (*counts, *sparse))
        sizes = [sum(glb_triangles(part, arrays) for part in mesh["primitives"]) for mesh in tree.get("meshes", [])]
        nodes = tree.get("nodes", [])
        children = {i: list(node.get("children", [])) for i, node in enumerate(nodes)}
        triangles = {i: sizes[node["mesh"]] for i, node in enumerate(nodes) if "mesh" in node}
        copies = {i: glb_copies(node, arrays) for i, node in enumerate(nodes) if "extensions" in node}
        check_scene(glb_roots(tree), children, triangles, copies)
    except MeshError:
        raise
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, RecursionError, OverflowError) as error:
        raise MeshError("its GLB header makes no sense; export the mesh again") from error


def glb_copies(node: Mapping, arrays: list) -> int:
    """How often a node shows its mesh: once, unless it is instanced."""
    instances = node.get("extensions", {}).get("EXT_mesh_gpu_instancing", {}).get("attributes", {})
    return max((int(arrays[which]["count"]) for which in instances.values()), default=1)


def threemf_root(archive: zipfile.ZipFile) -> str:
    """The name of the model that a 3MF begins with, "" if it has none."""
    models = [name for name in archive.namelist() if name.lower().endswith(".model")]
    known = {name.lower().lstrip("/"): name for name in models}
    if "_rels/.rels" in archive.namelist():
        text = archive.read("_rels/.rels").decode("utf-8", "replace")
        for relation in re.findall(r"<\s*(?:\w+:)?Relationship\b[^>]*>", text):
            target = re.search(r"\bTarget\s*=\s*[\"']([^\"']*)", relation)
            if target and "3dmanufacturing/2013/01/3dmodel" in relation:
                return known.get(target[1].lower().lstrip("/"), "")
    return known.get("3d/3dmodel.model", models[0] if len(models) == 1 else "")


def _check_3mf(data: bytes) -> None:
    """Of a 3MF's archive: what it unfolds to, the places of its files, and its objects made of objects."""
    from lxml import etree

    children: dict[Hashable, list[Hashable]] = {}
    triangles: dict[Hashable, int] = {}
    items: dict[str, list[Hashable]] = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            entries = archive.infolist()
            unfolded = sum(entry.file_size for entry in entries)
            if len(entries) > MAX_ENTRIES or unfolded > MAX_BYTES:
                raise MeshError(
                    f"unfolds to {len(entries)} files of {unfolded >> 20} MiB, more than is read; simplify it"
                )
            for entry in entries:
                if entry.filename.startswith(("/", "\\")) or ".." in Path(entry.filename).parts:
                    raise MeshError(
                        f"holds a file that climbs out of its folder, {entry.filename[:60]!r}; export it again"
                    )
            for entry in entries:
                if entry.filename.lower().endswith(".model"):
                    name = model_path(entry.filename)
                    with archive.open(entry) as file:
                        model = ModelXml(file.read(MAX_BYTES))
                    items[name] = _model_objects(model, name, children, triangles)
            root = model_path(threemf_root(archive))
    except MeshError:
        raise
    except (zipfile.BadZipFile, zipfile.LargeZipFile, etree.XMLSyntaxError) as error:
        raise MeshError("is no 3MF; export the mesh again") from error
    except (OSError, EOFError, RuntimeError, NotImplementedError, ValueError, zlib.error) as error:
        raise MeshError("its archive is damaged; export the mesh again") from error
    check_scene(items.get(root, []), children, triangles)


def model_path(name: str) -> str:
    """One spelling for the path of a model in a 3MF."""
    return posixpath.normpath("/" + name.strip().lstrip("/")).lower()


def _model_objects(model: ModelXml, name: str, children: dict, triangles: dict) -> list[Hashable]:
    """Enter a model's objects, each by its file and number; give those that its build names."""

    def key(part) -> Hashable:
        path = next((value for word, value in part.attrib.items() if word.endswith("}path")), name)
        return model_path(path), part.get("objectid", "")

    first: list[Hashable] = []
    for event, part in model.elements("object", "build"):
        if event == "start":
            continue
        if part.tag.endswith("build"):
            first += [key(item) for item in part.iter("{*}item")]
        else:
            own = name, part.get("id", "")
            children[own] = children.get(own, []) + [key(one) for one in part.iter("{*}component")]
            triangles[own] = triangles.get(own, 0) + model.count(part)
        part.clear()
    return first


CHECKS: dict[str, Callable[[bytes], None]] = {".glb": _check_glb, ".3mf": _check_3mf}
