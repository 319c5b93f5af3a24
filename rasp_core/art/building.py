"""Sculptures that can be built: a heap's objects, struts and a base as one closed solid, as large as a printer allows.

The solid is in millimetres, z up, its base on z = 0. What the views see of it is measured anew, with struts and base. A
picture ends at its lowest dark row, and the base is below; where a view looks from high above, its shadow falls on the
base, which is its wall then and no part of it.
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
from ..geometry.surface_points import surface_points
from ..silhouettes import likeness, render_at_rest
from ..util import o3d
from ..util.errors import InputError
from .hiding import Hiding, steep
from .sculpture import Sculpture
from .struts import Strut, find_struts

PRINTER_MM = (200.0, 200.0, 200.0)
THICKNESS_MM = 2.0
BASE_THICKNESSES = 2.0  # of a base, in those of a strut
GAP_THICKNESSES = 0.05  # between the pictures' ends and the base
MARGIN_PX = 1.0  # that struts keep to what is seen
LATTICE = 110  # steps along the longest edge of the space that is searched for struts
ANCHORS = 300  # points of a solid, where struts may end
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
    cameras = sculpture.cameras
    hiding = Hiding.of(sculpture.hull, sculpture.images > 0.5, cameras)
    names, solids = _solids(sculpture.bodies, sculpture.matrices)
    boxes = np.array([solid.bounding_box() for solid in solids])
    low, high = boxes[:, :3].min(0), boxes[:, 3:].max(0)
    top, thick = hiding.base_top(low, high), BASE_THICKNESSES * thickness_mm
    gap = GAP_THICKNESSES * thickness_mm
    room = printer - [0, 0, thick + gap]
    edges = np.array([*(high - low)[:2], high[2] - top])
    largest = float((room / edges).min())
    scale = largest if scale is None else scale
    if scale > largest * (1 + 1e-9):
        need = scale * edges + printer - room
        raise InputError(
            f"the piece is {' x '.join(f'{edge:.0f}' for edge in need)} mm and the printer's volume "
            f"{' x '.join(f'{edge:g}' for edge in printer)}; make the shadows smaller, or give a larger printer"
        )
    # from here on the base is a solid of the heap, in metres
    top, thick = top - gap / scale, thick / scale
    base = manifold3d.Manifold.cube([*(high - low)[:2], thick]).translate([*low[:2], top - thick])
    radius = thickness_mm / 2 / scale
    anchors, depth = _anchors(solids, radius)
    spacing = float(np.max(high - [*low[:2], top])) / LATTICE
    anchors.append(_base_anchors(low, high, top - thick / 2, radius, spacing))
    struts, alone = find_struts(
        anchors,
        hiding.clearance,
        radius,
        MARGIN_PX * cameras[0].width / hiding.dark.shape[-1],
        spacing,
        np.array([*low[:2], top - thick / 2]),
        high,
    )
    if alone:
        _refuse([*names, "the base"], alone, thickness_mm)
    shift = -scale * np.array([*(low + high)[:2] / 2, top - thick])
    whole = manifold3d.Manifold.batch_boolean(
        [*solids, base, *(strut.solid() for strut in struts)], manifold3d.OpType.Add
    ).trim_by_plane((0, 0, 1), top - thick)
    vertices, faces = _printable(whole.scale([scale] * 3).translate(shift))
    built = Built(
        sculpture=sculpture,
        vertices=vertices,
        faces=faces,
        scale=scale,
        shift=shift,
        struts=struts,
        base_mm=scale * np.array([*(high - low)[:2], thick]),
        names=[*names, "base"],
        images=np.zeros_like(hiding.dark),
        thickness_mm=thickness_mm,
        thin=float((depth < 2 * radius).mean()),
    )
    return replace(built, images=_seen(built, hiding, top))


def check_printer(printer_mm: Sequence[float] = PRINTER_MM, thickness_mm: float = THICKNESS_MM) -> np.ndarray:
    """`(3,)` a printer's volume. Raises InputError unless it and the thickness are lengths that go together."""
    printer = np.asarray(printer_mm, float)
    if printer.shape != (3,) or not ((printer > 0) & np.isfinite(printer)).all():
        raise InputError(f"a printer's volume is three positive lengths in mm, got {printer.tolist()}")
    if not 0 < thickness_mm < printer.min() / 10:
        raise InputError(
            f"struts must be thicker than 0 and thinner than a tenth of the printer's {printer.min():g} mm, "
            f"got {thickness_mm:g} mm"
        )
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


def _anchors(solids: Sequence[manifold3d.Manifold], radius: float) -> tuple[list[np.ndarray], np.ndarray]:
    """For each solid points `(A, 3)` in it, as deep as a strut's radius or in the middle of thinner walls; and for all
    of them in a row how thick the walls are."""
    surfaces, starts, inward = [], [], []
    for solid in solids:
        mesh = solid.to_mesh64()
        vertices, faces = np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, np.int64)
        points, normals = surface_points(vertices, faces, ANCHORS)
        surfaces.append((vertices, faces))
        starts.append(points)
        inward.append(-normals)
    points, inward = np.concatenate(starts), np.concatenate(inward)
    size = float(np.ptp(points, axis=0).max())
    skin = 1e-5 * size
    rays = np.concatenate([points + skin * inward, inward], 1).astype(np.float32)
    depth = skin + o3d.caster(surfaces).cast_rays(o3d.load().core.Tensor(rays))["t_hit"].numpy().astype(float)
    inner = points + np.minimum(depth / 2, radius)[:, None] * inward
    return np.split(inner, np.cumsum([len(x) for x in starts])[:-1]), depth


def _base_anchors(low: np.ndarray, high: np.ndarray, z: float, radius: float, spacing: float) -> np.ndarray:
    """Points `(A, 3)` in the middle of a base, a strut's largest radius from its rim."""
    axes = [np.arange(low[k] + 2 * radius, high[k] - 2 * radius, spacing) for k in (0, 1)]
    flat = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2)
    return np.column_stack([flat, np.full(len(flat), z)])


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
