"""Sculptures that can be built: a heap's objects, struts and a base as one closed solid, as large as a printer allows.

The solid is in millimetres, z up, its base on z = 0. What the views see of it is measured anew, with struts and base. A
picture ends at its lowest dark row, or a little higher where no strut fits, and the base is below; where a view looks
from high above, its shadow falls on the base, which is its wall then and no part of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import manifold3d
import numpy as np
import trimesh

from ..exact.placing import placed_solid
from ..geometry.meshes import Body, make_body
from ..geometry.silhouette_edges import Views
from ..silhouettes import likeness, render_at_rest
from ..util.errors import InputError
from .anchors import base_points, inner_points
from .hiding import Hiding, steep
from .sculpture import Sculpture
from .struts import Strut, find_struts

PRINTER_MM = (200.0, 200.0, 200.0)
THICKNESS_MM = 2.0
BASE_THICKNESSES = 2.0  # of a base, in those of a strut
GAP_THICKNESSES = 0.05  # between the pictures' ends and the base
MARGIN_PX = 1.0  # that struts keep to what is seen
LIFTS = 0.0, 0.01, 0.02, 0.03, 0.05  # of a picture, by which the base is higher than its end, until a strut reaches it
LATTICE = 110  # steps along the longest edge of the space that is searched for struts
THIN_SHARE = 0.01  # of the objects' surface, behind which thin walls are worth a word
SPECK = 1e-6  # of a solid's volume: parts that are smaller are left out
SMOOTHED_MM = 1e-3  # how far the surface may stray
APART_MM = 2e-3  # between vertices that would be one


@dataclass(frozen=True)
class Built:
    """One closed solid.

    sculpture : the heap. vertices `(V, 3)` float64 millimetres, on z = 0 about the middle of the base, all of which are
    float32, too; faces `(F, 3)`. scale : millimetres in a metre of the heap; shift `(3,)` : what is added to the heap's
    scaled coordinates. struts : in the heap's metres. base_mm `(3,)` : the base's edges. names : of the solids that
    struts join, the base last. images `(K, H, H)` bool: what the views see. thickness_mm : of struts and joints, at
    least. thin : share of the objects' surface behind which there is less.
    """

    sculpture: Sculpture
    vertices: np.ndarray
    faces: np.ndarray
    scale: float
    shift: np.ndarray
    struts: Sequence[Strut]
    base_mm: np.ndarray
    names: Sequence[str]
    images: np.ndarray
    thickness_mm: float
    thin: float

    @property
    def size_mm(self) -> np.ndarray:
        """`(3,)` the solid's extent."""
        return np.ptp(self.vertices, axis=0)

    @property
    def likeness(self) -> np.ndarray:
        """`(K,)` intersection over union with the pictures."""
        return likeness(self.images, self.sculpture.pictures)

    @property
    def of_ceiling(self) -> np.ndarray:
        """`(K,)` intersection over union with the silhouettes of the pictures' visual hull."""
        return likeness(self.images, self.sculpture.hull)

    def to_dict(self) -> dict:
        """As plain numbers, for `result.json`."""
        return {
            "size_mm": self.size_mm.tolist(),
            "base_mm": self.base_mm.tolist(),
            "thickness_mm": self.thickness_mm,
            "mm_per_metre": self.scale,
            "shift_mm": self.shift.tolist(),
            "struts": len(self.struts),
            "strut_mm": self.scale * sum(strut.length for strut in self.struts),
            "thin_share": self.thin,
            "likeness": self.likeness.tolist(),
            "likeness_of_ceiling": self.of_ceiling.tolist(),
            "triangles": len(self.faces),
            "volume_mm3": float(trimesh.Trimesh(self.vertices, self.faces, process=False).volume),
        }

    def line(self) -> str:
        """What it is, in words."""
        x, y, z = self.size_mm
        return (
            f"one closed piece of {x:.0f} x {y:.0f} x {z:.0f} mm, {self.scale / 1000:.3g} of true size, "
            f"{len(self.struts)} hidden struts, likeness above the base {self.of_ceiling.min():.1%} of the ceiling at "
            "least"
        )

    @property
    def warnings(self) -> list[str]:
        """In words, what to heed in printing."""
        if self.thin < THIN_SHARE:
            return []
        return [
            f"walls are thinner than {self.thickness_mm:g} mm behind {self.thin:.0%} of the objects' surface; print "
            "larger, or take thicker objects"
        ]


def build(
    sculpture: Sculpture,
    printer_mm: Sequence[float] = PRINTER_MM,
    thickness_mm: float = THICKNESS_MM,
    scale: float | None = None,
) -> Built:
    """One closed solid of a heap, on a base, that fills a printer's volume (x, y, z).

    thickness_mm : of struts and joints, at least. scale : millimetres in a metre, if the piece is not to fill the
    volume. Raises InputError for lengths that are not positive, a piece that is larger than the printer, a base that
    would stand before a view, and where no hidden strut joins some of the objects; it names them.
    """
    printer = check_printer(printer_mm, thickness_mm)
    names, solids = _solids(sculpture.bodies, sculpture.matrices)
    for lift in LIFTS:
        rows = round(lift * sculpture.hull.shape[-1])
        hiding = Hiding.of(sculpture.hull, sculpture.images > 0.5, sculpture.cameras, rows)
        plan = _Plan(solids, hiding, printer, thickness_mm, scale)
        if plan.alone != [len(solids)]:
            break  # a higher base helps only what stands on nothing
    if plan.alone:
        _refuse([*names, "the base"], plan.alone, thickness_mm)
    vertices, faces = _printable(plan.whole(solids).scale([plan.scale] * 3).translate(plan.shift))
    built = Built(
        sculpture=sculpture,
        vertices=vertices,
        faces=faces,
        scale=plan.scale,
        shift=plan.shift,
        struts=plan.struts,
        base_mm=plan.scale * plan.base_size,
        names=[*names, "base"],
        images=np.zeros_like(hiding.dark),
        thickness_mm=thickness_mm,
        thin=float((plan.depth < 2 * plan.radius).mean()),
    )
    return replace(built, images=_seen(built, hiding, plan.top))


class _Plan:
    """Where the base is, and the struts, in the heap's metres; `alone`: the numbers of what no strut reaches, the
    base's being the one after the solids'."""

    def __init__(self, solids, hiding: Hiding, printer: np.ndarray, thickness_mm: float, scale: float | None):
        boxes = np.array([solid.bounding_box() for solid in solids])
        low, high = boxes[:, :3].min(0), boxes[:, 3:].max(0)
        top, gap = hiding.base_top(low, high), GAP_THICKNESSES * thickness_mm
        room = printer - [0, 0, BASE_THICKNESSES * thickness_mm + gap]
        edges = np.array([*(high - low)[:2], high[2] - top])
        largest = float((room / edges).min())
        self.scale = scale = largest if scale is None else scale
        if scale > largest * (1 + 1e-9):
            need = scale * edges + printer - room
            raise InputError(
                f"the piece is {' x '.join(f'{edge:.0f}' for edge in need)} mm and the printer's volume "
                f"{' x '.join(f'{edge:g}' for edge in printer)}; make the shadows smaller, or give a larger printer"
            )
        self.top, thick = top - gap / scale, BASE_THICKNESSES * thickness_mm / scale
        self.bottom, self.radius = self.top - thick, thickness_mm / 2 / scale
        self.base_size = np.array([*(high - low)[:2], thick])
        self.base = manifold3d.Manifold.cube(self.base_size).translate([*low[:2], self.bottom])
        self.shift = -scale * np.array([*(low + high)[:2] / 2, self.bottom])
        spacing = float(np.max(high - [*low[:2], self.top])) / LATTICE
        middle = self.top - thick / 2
        anchors, self.depth = inner_points(solids, self.radius)
        least = np.pi * self.radius**2 * thick / 2  # of a solid in the base: as much as a strut would have there
        self.struts, self.alone = find_struts(
            [*anchors, base_points(low, high, middle, self.radius, spacing)],
            hiding.clearance,
            self.radius,
            MARGIN_PX * hiding.cameras[0].width / hiding.dark.shape[-1],
            spacing,
            np.array([*low[:2], middle]),
            high,
            joined=[
                (k, len(solids))
                for k in np.flatnonzero(boxes[:, 2] < middle)
                if (solids[k] ^ self.base).volume() > least
            ],
        )

    def whole(self, solids: Sequence[manifold3d.Manifold]) -> manifold3d.Manifold:
        """All in one, flat below."""
        parts = [*solids, self.base, *(strut.solid() for strut in self.struts)]
        return manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add).trim_by_plane((0, 0, 1), self.bottom)


def check_printer(printer_mm: Sequence[float] = PRINTER_MM, thickness_mm: float = THICKNESS_MM) -> np.ndarray:
    """`(3,)` a printer's volume. Raises InputError unless it and the thickness are lengths that go together."""
    printer = printer_volume(printer_mm)
    if not 0 < thickness_mm < printer.min() / 10:
        raise InputError(
            f"struts must be thicker than 0 and thinner than a tenth of the printer's {printer.min():g} mm, "
            f"got {thickness_mm:g} mm"
        )
    return printer


def printer_volume(printer_mm: Sequence[float]) -> np.ndarray:
    """`(3,)`, mm. Raises InputError unless these are three positive lengths."""
    printer = np.asarray(printer_mm, float)
    if printer.shape != (3,) or not ((printer > 0) & np.isfinite(printer)).all():
        raise InputError(f"a printer's volume is three positive lengths in mm, got {printer.tolist()}")
    return printer


def _refuse(names: Sequence[str], alone: Sequence[int], thickness_mm: float) -> None:
    shown = ", ".join(names[k] for k in alone[:5]) + (f" and {len(alone) - 5} more" if len(alone) > 5 else "")
    raise InputError(
        f"struts impossible: none of {thickness_mm:g} mm that no view sees reaches {shown}; ask for thinner struts, or "
        "larger pictures"
    )


def _solids(bodies: Sequence[Body], matrices: np.ndarray) -> tuple[list[str], list[manifold3d.Manifold]]:
    """The connected solids that placed bodies consist of, cavities filled, and the names of their bodies."""
    found = [
        (body.name, part)
        for body, matrix in zip(bodies, matrices, strict=True)
        for part in placed_solid(body, matrix).decompose()
        if part.volume() > SPECK * body.volume
    ]
    return [name for name, _ in found], [part for _, part in found]


def _printable(whole: manifold3d.Manifold) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a solid without its cavities. Raises InputError if it is not in one piece."""
    pieces = [piece for piece in whole.simplify(SMOOTHED_MM).decompose() if piece.volume() > SPECK * whole.volume()]
    mesh = max(pieces, key=lambda piece: piece.volume()).to_mesh64()
    vertices = _apart(np.array(mesh.vert_properties, np.float32)[:, :3])  # as an STL keeps them
    read = trimesh.Trimesh(vertices, np.array(mesh.tri_verts, np.int64))  # merges equal ones, as readers of STL do
    if len(pieces) > 1 or not read.is_watertight or read.body_count != 1 or not read.is_winding_consistent:
        raise InputError(f"the heap does not become one closed piece ({len(pieces)} pieces); try another seed")
    return np.asarray(read.vertices), np.asarray(read.faces)


def _apart(vertices: np.ndarray) -> np.ndarray:
    """Vertices `(V, 3)` float32, as float64, with those that are equal moved apart by less than anyone can print: where
    surfaces touch, they would be read as one vertex, about which the surface is no longer closed."""
    vertices, random = vertices.copy(), np.random.default_rng(0)
    while True:
        first = np.unique(vertices, axis=0, return_index=True)[1]
        again = np.setdiff1d(np.arange(len(vertices)), first)
        if not len(again):
            return vertices.astype(np.float64)
        vertices[again] += random.uniform(-APART_MM, APART_MM, (len(again), 3)).astype(np.float32)


def _seen(built: Built, hiding: Hiding, top: float) -> np.ndarray:
    """`(K, H, H)` bool: what the views see of the built solid; `top` : of the base, metres."""
    vertices, gap = (built.vertices - built.shift) / built.scale, GAP_THICKNESSES * built.thickness_mm / built.scale
    whole = make_body("built", vertices, built.faces)
    found = []
    for camera, bottom in zip(hiding.cameras, hiding.bottom, strict=True):
        body = whole
        if steep(camera):
            mesh = whole.manifold.translate(whole.centre).trim_by_plane((0, 0, 1), top + gap).to_mesh64()
            body = make_body("above", np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts))
        image = render_at_rest(body, Views([camera]), hiding.dark.shape[-1]).numpy()[0] > 0.5
        image[bottom:] = False
        found.append(image)
    return np.stack(found)
