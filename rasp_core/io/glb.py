"""GLB: the default scene of a binary glTF 2, a part for each node that shows a mesh."""

from __future__ import annotations

import struct
from collections import Counter

import numpy as np

from ..util.errors import MeshError
from .bounds import glb_copies, glb_json, glb_roots
from .glb_arrays import GlbArrays
from .parts import FilePart, MeshFile, joined, placed, used_only

KNOWN = ("KHR_mesh_quantization", "EXT_mesh_gpu_instancing")  # extensions that change where vertices are
LENGTHS = {
    **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", "millimetres"), 1e-3),
    **dict.fromkeys(("cm", "centimeter", "centimeters", "centimetre", "centimetres"), 1e-2),
    **dict.fromkeys(("in", "inch", "inches"), 0.0254),
    **dict.fromkeys(("ft", "foot", "feet"), 0.3048),
}


def parse(data: bytes) -> MeshFile:
    """The parts of a GLB, where its nodes put them.

    The unit is the metre, unless all its meshes say otherwise in their extras, as trimesh writes them. Raises MeshError
    where meshes are compressed, arrays do not fit into their bytes, or the scene shows no triangles.
    """
    tree = glb_json(data)
    try:
        return _Reader(tree, data).file()
    except MeshError:
        raise
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, OverflowError, struct.error) as error:
        raise MeshError("its GLB header makes no sense; export the mesh again") from error


class _Reader:
    def __init__(self, tree: dict, data: bytes):
        self.tree = tree
        self.read = GlbArrays(tree, data).array
        self.left_out: Counter[str] = Counter()
        self.meshes: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    def file(self) -> MeshFile:
        notes = [
            f"the extension {str(name)[:60]!r} is not read"
            for name in self.tree.get("extensionsRequired", [])
            if name not in KNOWN and not str(name).startswith(("KHR_materials_", "KHR_texture_"))
        ]
        nodes, parts, shown = self.tree.get("nodes", []), [], []
        waiting = [(k, np.eye(4)) for k in reversed(glb_roots(self.tree))]
        while waiting:
            node, above = waiting.pop()
            node = nodes[node]
            with np.errstate(all="ignore"):
                matrix = above @ _matrix(node)
            waiting += [(k, matrix) for k in reversed(node.get("children", []))]
            if "mesh" not in node:
                continue
            vertices, faces = self._mesh(node["mesh"])
            if not len(faces):
                continue
            shown.append(self.tree["meshes"][node["mesh"]])
            self.left_out["skins (bones move nothing here)"] += "skin" in node
            weights = node.get("weights", shown[-1].get("weights", []))
            self.left_out["shape keys that are not zero"] += any(weights)
            name = str(node.get("name") or shown[-1].get("name") or "")
            for one in self._instances(node):
                parts.append(FilePart(name, *placed(vertices, faces, matrix @ one)))
        if not parts:
            raise MeshError("its scene shows no triangles; export it as a triangle mesh")
        if not self.tree.get("scenes"):
            notes.append("has no scene; all its nodes are taken")
        elif len(self.tree["scenes"]) > 1:
            notes.append("of its scenes only the default one is taken")
        notes += [f"left out: {count} {name}" for name, count in self.left_out.items() if count]
        metres, note = _unit(shown)
        return MeshFile(tuple(parts), metres, (*notes, *note))

    def _mesh(self, which: int) -> tuple[np.ndarray, np.ndarray]:
        """The triangles of all primitives of a mesh, without the vertices that none of them names."""
        if which not in self.meshes:
            surfaces = [self._primitive(part) for part in self.tree["meshes"][which]["primitives"]]
            self.meshes[which] = joined([surface for surface in surfaces if surface is not None])
        return self.meshes[which]

    def _primitive(self, part: dict) -> tuple[np.ndarray, np.ndarray] | None:
        mode = part.get("mode", 4)
        if mode not in (4, 5, 6):
            self.left_out["primitives of points or lines"] += 1
            return None
        if "POSITION" not in part["attributes"]:
            self.left_out["primitives without positions"] += 1
            return None
        vertices = self.read(part["attributes"]["POSITION"], "VEC3")
        if "indices" in part:
            corners = self.read(part["indices"], "SCALAR")[:, 0].astype(np.int64)
        else:
            corners = np.arange(len(vertices))
        if mode == 4:
            if len(corners) % 3:
                self.left_out["corners that make no whole triangle"] += len(corners) % 3
            faces = corners[: len(corners) // 3 * 3].reshape(-1, 3)
        elif mode == 5:  # a strip, in which every second triangle is turned
            faces = np.stack([corners[:-2], corners[1:-1], corners[2:]], -1)
            faces[1::2] = faces[1::2, [1, 0, 2]]
            faces = _sound(faces)
        else:
            faces = np.stack([np.full(max(len(corners) - 2, 0), corners[0]), corners[1:-1], corners[2:]], -1)
            faces = _sound(faces)
        if len(faces) and faces.max() >= len(vertices):
            raise MeshError("faces name vertices that are not there; export the mesh again")
        vertices, faces = used_only(vertices, faces)
        return vertices.astype(np.float64), faces

    def _instances(self, node: dict) -> list[np.ndarray]:
        """Where a node shows its mesh, in its own frame."""
        given = node.get("extensions", {}).get("EXT_mesh_gpu_instancing", {}).get("attributes", {})
        if not given:
            return [np.eye(4)]
        count = glb_copies(node, self.tree.get("accessors", []))
        read = {name: self.read(given[name], kind) for name, kind in TRS.items() if name in given}
        if any(len(rows) != count for rows in read.values()):
            raise MeshError("its instances are not as many in each array; export it without instancing")
        return [_matrix({name.lower(): rows[k] for name, rows in read.items()}) for k in range(count)]


TRS = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}


def _matrix(node: dict) -> np.ndarray:
    """`(4, 4)` of a node, from its matrix or from its scale, rotation and translation."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    x, y, z, w = (float(number) for number in node.get("rotation", (0, 0, 0, 1)))
    length = np.sqrt(x * x + y * y + z * z + w * w)
    matrix = np.eye(4)
    if length > 0:
        x, y, z, w = np.array([x, y, z, w]) / length
        matrix[:3, :3] += 2 * np.array(
            [
                [-y * y - z * z, x * y - z * w, x * z + y * w],
                [x * y + z * w, -x * x - z * z, y * z - x * w],
                [x * z - y * w, y * z + x * w, -x * x - y * y],
            ]
        )
    matrix[:3, :3] *= np.asarray(node.get("scale", (1, 1, 1)), np.float64)
    matrix[:3, 3] = np.asarray(node.get("translation", (0, 0, 0)), np.float64)
    return matrix


def _sound(faces: np.ndarray) -> np.ndarray:
    """Without the triangles that only turn a strip: those that name a corner twice."""
    return faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]


def _unit(meshes: list[dict]) -> tuple[float, tuple[str, ...]]:
    """The length of the unit, and a note where it is not the metre that the standard has."""
    words = {str((mesh.get("extras") or {}).get("units", "")).lower() for mesh in meshes}
    word = words.pop() if len(words) == 1 else ""
    if word in LENGTHS:
        return LENGTHS[word], (f"its extras say that its unit is {word}, which is taken; GLB's own is the metre",)
    return 1.0, ()
