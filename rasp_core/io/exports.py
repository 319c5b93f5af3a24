"""Placed parts as 3MF, STL and CSV, for slicers, CAD and robots.

A 3MF has one object for each shape, in millimetres, and for each part one named object that puts it in its place.
"""

from __future__ import annotations

import csv
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from ..util.errors import InputError
from ..util.numbering import numbered
from .stl import TRIANGLE

MILLIMETRES = 1000.0  # in a metre
CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>\n'
)
RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target='
    '"/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>'
    "</Relationships>\n"
)


@dataclass(frozen=True)
class PlacedPart:
    """A part in its place.

    name : of this copy. source : its file. shape : equal for copies of one surface. vertices `(V, 3)` metres, about the
    part's centre; faces `(F, 3)`. pose `(4, 4)` : from there to the world. matrix `(4, 4)` : from the file's
    coordinates to the world.
    """

    name: str
    source: str
    shape: object
    vertices: np.ndarray
    faces: np.ndarray
    pose: np.ndarray
    matrix: np.ndarray


def write_3mf(path: Path, parts: Sequence[PlacedPart]) -> None:
    """Write a 3MF: a mesh for each shape, and for each part an object of its name with the mesh as its component."""
    meshes: dict[object, int] = {}
    shapes, objects, items = [], [], []
    for part in parts:
        if part.shape not in meshes:
            meshes[part.shape] = len(meshes) + 1
            shapes.append(_mesh(meshes[part.shape], part))
    for number, part in enumerate(parts, len(meshes) + 1):
        place = part.pose[:3].T.copy()  # 3MF multiplies rows
        place[3] *= MILLIMETRES
        transform = " ".join(f"{value:.17g}" for value in place.ravel())
        objects.append(
            f'<object id="{number}" type="model" name={quoteattr(part.name)}><components><component '
            f'objectid="{meshes[part.shape]}" transform="{transform}"/></components></object>\n'
        )
        items.append(f'<item objectid="{number}"/>\n')
    model = (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<model unit="millimeter" xml:lang="en-US" xmlns="{CORE}">\n'
        f"<resources>\n{''.join(shapes)}{''.join(objects)}</resources>\n<build>\n{''.join(items)}</build>\n</model>\n"
    )
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("[Content_Types].xml", TYPES)
        archive.writestr("_rels/.rels", RELATIONS)
        archive.writestr("3D/3dmodel.model", model)


def _mesh(number: int, part: PlacedPart) -> str:
    points = part.vertices * MILLIMETRES
    vertices = "".join(f'<vertex x="{x:.12g}" y="{y:.12g}" z="{z:.12g}"/>\n' for x, y, z in points.tolist())
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>\n' for a, b, c in part.faces.tolist())
    kind = quoteattr(numbered(part.name)[0])  # what readers that look through components show
    return (
        f'<object id="{number}" type="model" name={kind}><mesh>\n<vertices>\n{vertices}</vertices>\n'
        f"<triangles>\n{triangles}</triangles>\n</mesh></object>\n"
    )


def write_stl(path: Path, parts: Sequence[PlacedPart]) -> None:
    """Write one binary STL of all parts, in millimetres."""
    corners = []
    for part in parts:
        placed = part.vertices @ part.pose[:3, :3].T + part.pose[:3, 3]
        corners.append(MILLIMETRES * placed[part.faces])
    corners = np.concatenate(corners)
    triangles = np.zeros(len(corners), TRIANGLE)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    triangles["normal"] = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    triangles["corners"] = corners
    head = b"placed parts, in millimetres".ljust(80)
    path.write_bytes(head + np.uint32(len(triangles)).tobytes() + triangles.tobytes())


def write_csv(path: Path, parts: Sequence[PlacedPart]) -> None:
    """Write a row for each part: its file, its copy's number, the matrix `(4, 4)` from the file's coordinates in metres
    to the world, row by row, and the same turn as a unit quaternion, scalar first."""
    from scipy.spatial.transform import Rotation

    entries = [f"m{i}{j}" for i in range(4) for j in range(4)]
    copies: dict[str, int] = {}
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["name", "file", "copy", *entries, "qw", "qx", "qy", "qz"])
        for part in parts:
            stem, _ = numbered(part.name)
            copies[stem] = copies.get(stem, 0) + 1
            x, y, z, w = Rotation.from_matrix(part.matrix[:3, :3]).as_quat()
            numbers = [repr(float(value)) for value in (*part.matrix.ravel(), w, x, y, z)]
            writer.writerow([part.name, part.source, copies[stem], *numbers])


WRITERS = {"3mf": write_3mf, "stl": write_stl, "csv": write_csv}


def formats(text: str) -> list[str]:
    """The formats named in "3mf,stl,csv". Raises InputError for one that is not written."""
    found = [word.strip().lower() for word in text.split(",") if word.strip()]
    for word in found:
        if word not in WRITERS:
            raise InputError(f"{word!r} is not written; export some of {', '.join(WRITERS)}")
    return found
