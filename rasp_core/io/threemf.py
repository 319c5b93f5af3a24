"""3MF: the items of a build, each an object made of meshes and of other objects, in files of the same archive."""

from __future__ import annotations

import io
import zipfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ..util.errors import MeshError
from .bounds import MAX_BYTES, model_path, threemf_root
from .model_xml import ModelXml
from .parts import FilePart, MeshFile, joined, placed, used_only
from .slicer_settings import LEFT_OUT, NEGATIVE, SOLID, Settings, read_settings
from .text import floats

METRES = {"micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048, "meter": 1.0}
HARMLESS = ("production", "material", "slice", "trianglesets", "beamlattice", "securecontent")  # extensions, by address
CURA = ("support_mesh", "anti_overhang_mesh", "infill_mesh", "cutting_mesh")  # Cura's marks of what is no part


@dataclass
class Object:
    """A resource. surface : `(V, 3)`, `(F, 3)` or None; components : (file, object's number, matrix `(4, 4)`)."""

    name: str
    kind: str
    surface: tuple[np.ndarray, np.ndarray] | None = None
    components: list[tuple[str, str, np.ndarray]] = field(default_factory=list)


@dataclass
class Item:
    """What a build places."""

    path: str
    number: str
    matrix: np.ndarray
    name: str
    printable: bool


@dataclass
class Model:
    """One file of the archive. objects : by their numbers."""

    metres: float
    objects: dict[str, Object] = field(default_factory=dict)
    items: list[Item] = field(default_factory=list)


def parse(data: bytes) -> MeshFile:
    """The parts of a 3MF: its build items, without supports, modifiers and what is not to be printed.

    The archive keeps to the bounds (`bounds.CHECKS`). Raises MeshError where objects are missing or nothing is left.
    """
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return _Reader(archive).file()


class _Reader:
    def __init__(self, archive: zipfile.ZipFile):
        self.archive = archive
        self.names = {model_path(name): name for name in archive.namelist()}
        self.root = model_path(threemf_root(archive))
        self.models: dict[str, Model] = {}
        self.settings: Settings = read_settings(archive)
        self.notes: Counter[str] = Counter()

    def file(self) -> MeshFile:
        model, parts = self._model(self.root), []
        for item in model.items:
            part = self._part(item)
            if part is not None:
                parts.append(part)
        notes = tuple(note if count == 1 else f"{note} ({count} times)" for note, count in self.notes.items())
        if not parts:
            why = f" ({'; '.join(notes)[:200]})" if notes else ""
            raise MeshError(f"its build holds no triangles{why}; export it as a triangle mesh")
        return MeshFile(tuple(parts), model.metres, notes)

    def _part(self, item: Item) -> FilePart | None:
        settings = self.settings.objects.get(item.number) if item.path == self.root else None
        top = self._object(item.path, item.number)
        name = (settings and settings.name) or top.name or item.name
        if not name and len(top.components) == 1:
            name = self._object(*top.components[0][:2]).name
        if not item.printable:
            self.notes[f"{name or 'an item'} is left out, as it is not to be printed"] += 1
            return None
        solids, cuts = [], []
        for role, vertices, faces in self._surfaces(item, settings):
            if len(faces):
                (cuts if role == NEGATIVE else solids).append((vertices, faces))
        if not solids:
            return None
        return FilePart(name, *joined(solids), tuple(cuts))

    def _surfaces(self, item: Item, settings) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
        """What an item is made of, moved to its place: role, `(V, 3)`, `(F, 3)`."""
        waiting = [(item.path, item.number, item.matrix, SOLID, True)]
        while waiting:
            path, number, matrix, role, top = waiting.pop()
            found = self._object(path, number)
            if found.kind != "model":
                self.notes[f"{found.name or 'an object'} of the type {found.kind} is left out"] += 1
                continue
            if found.surface is not None:
                ranges = settings.ranges if settings and top else []
                for part_role, name, vertices, faces in _split(*found.surface, ranges):
                    if part_role == LEFT_OUT:
                        self.notes[f"{name} is left out"] += 1
                    else:
                        yield (role if part_role == SOLID else part_role), *placed(vertices, faces, matrix)
            for where, which, moved in reversed(found.components):
                part = settings.parts.get(which) if settings and top else None
                if part is not None and part.role == LEFT_OUT:
                    self.notes[f"{part.name} is left out"] += 1
                    continue
                within = part.role if part is not None and part.role != SOLID else role
                waiting.append((where, which, matrix @ moved, within, False))

    def _object(self, path: str, number: str) -> Object:
        found = self._model(path).objects.get(number)
        if found is None:
            raise MeshError(f"names an object that is not there ({number[:20]} in {path[:60]}); export the mesh again")
        return found

    def _model(self, path: str) -> Model:
        if path not in self.models:
            if path not in self.names or not path.endswith(".model"):
                raise MeshError(f"has no model {path[:60]!r} in its archive; export the mesh again")
            with self.archive.open(self.names[path]) as file:
                model = _read_model(file.read(MAX_BYTES), path, self.notes)
            self.models[path] = model
            if path != self.root and (scale := model.metres / self.models[self.root].metres) != 1:
                self._rescale(model, scale)
        return self.models[path]

    def _rescale(self, model: Model, scale: float) -> None:
        """Bring a model of another unit into the unit of the first one."""
        for number, one in model.objects.items():
            surface = one.surface and (one.surface[0] * scale, one.surface[1])
            for _, _, matrix in one.components:
                matrix[:3, 3] *= scale
            model.objects[number] = replace(one, surface=surface)
        self.notes["its files have different units; each is taken in its own"] += 1


def _split(vertices, faces, ranges) -> Iterator[tuple[str, str, np.ndarray, np.ndarray]]:
    """The volumes of a mesh by ranges of its triangles; what no range names is solid."""
    left = np.ones(len(faces), bool)
    for first, last, part in ranges:
        left[first : last + 1] = False
        if part.role != SOLID:
            yield part.role, part.name, *used_only(vertices, faces[first : last + 1])
        else:
            left[first : last + 1] = True
    yield SOLID, "", *(used_only(vertices, faces[left]) if ranges else (vertices, faces))


def _read_model(text: bytes, path: str, notes: Counter[str]) -> Model:
    xml, model = ModelXml(text), None
    for event, part in xml.elements("model", "object", "build"):
        word = part.tag.rpartition("}")[2]
        if event == "start" and word == "model":
            unit = part.get("unit", "millimeter").strip().lower()
            if unit not in METRES:
                raise MeshError(f"its unit {unit[:30]!r} is unknown; use one of {', '.join(METRES)}")
            model = Model(METRES[unit])
            for prefix in part.get("requiredextensions", "").split():
                address = part.nsmap.get(prefix, prefix)
                if not any(f"/{known}/" in f"{address}/" for known in HARMLESS):
                    notes[f"the extension {address[:80]!r} that it requires is not read"] += 1
        elif event == "end" and word == "object" and model is not None:
            number = part.get("id", "")
            if number in model.objects:
                raise MeshError(f"has two objects of the number {number[:20]}; export the mesh again")
            model.objects[number] = _read_object(xml, part, path, notes)
            part.clear()
        elif event == "end" and word == "build" and model is not None:
            for item in part.iter("{*}item"):
                printable = _any(item, "printable").strip().lower() not in ("0", "false")
                model.items.append(Item(*_reference(item, path), item.get("partnumber", "").strip(), printable))
            part.clear()
    if model is None:
        raise MeshError("has a model that is none; export the mesh again")
    return model


def _any(element, name: str, default: str = "") -> str:
    """An attribute of whatever namespace."""
    return next((value for key, value in element.attrib.items() if key.rpartition("}")[2] == name), default)


def _reference(element, path: str) -> tuple[str, str, np.ndarray]:
    """The object that an item or component names, and where it puts it."""
    matrix, words = np.eye(4), element.get("transform", "").split()
    if words:
        if len(words) != 12:
            raise MeshError(f"has a transform of {len(words)} numbers, 12 are needed; export the mesh again")
        rows = floats(words).reshape(4, 3)
        matrix[:3] = rows.T
    return model_path(_any(element, "path", path)), element.get("objectid", ""), matrix


def _read_object(xml: ModelXml, part, path: str, notes: Counter[str]) -> Object:
    name = part.get("name", "").strip() or part.get("partnumber", "").strip()
    found = Object(name, part.get("type", "model").strip().lower())
    for child in part.iterchildren("{*}*"):
        word = child.tag.rpartition("}")[2]
        if word == "mesh":
            found.surface = _read_mesh(xml, child)
            if next(child.iter("{*}beamlattice"), None) is not None:
                notes[f"the beam lattice of {name or 'an object'} is left out"] += 1
        elif word == "components":
            found.components = [_reference(one, path) for one in child.iter("{*}component")]
        elif word == "metadatagroup":
            for data in child.iter("{*}metadata"):
                mark = data.get("name", "").rpartition(":")[2]
                if mark in CURA and (data.text or "").strip().lower() == "true":
                    found.kind = mark
        else:
            notes[f"the {word[:40]} of {name or 'an object'} is not read"] += 1
    return found


def _read_mesh(xml: ModelXml, mesh) -> tuple[np.ndarray, np.ndarray]:
    vertices, faces = xml.numbers(mesh, "vertices"), xml.numbers(mesh, "triangles")
    if len(faces) and (faces.min() < 0 or faces.max() >= len(vertices)):
        raise MeshError("faces name vertices that are not there; export the mesh again")
    return vertices, faces
