"""Sculptures that hang, at the door: objects on threads below a plate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..art.hanging import Hung, hang
from ..art.threads import surface_of
from ..exact.placing import placed_solid
from ..geometry.meshes import Body, make_body
from ..io.exports import MILLIMETRES, PlacedPart, write_3mf
from ..physics.swinging import Swinging, swing
from .result import Result

if TYPE_CHECKING:
    from PIL.Image import Image

SHOWN_MM = 1.5  # thick, at least: threads in pictures


def hung(heap: Result, printer_mm: Sequence[float], thread_mm: float) -> HungResult:
    """A `SculptureResult` on threads, as its `hang` says."""
    scale = None if heap.in_room is None else MILLIMETRES * heap.in_room.scale
    found = hang(heap.art, printer_mm, thread_mm, scale)
    solids = [placed_solid(body, matrix) for body, matrix in zip(heap.bodies, heap.matrices, strict=True)]
    return HungResult(heap, found, swing(solids, found.threads, heap.cameras[0].width))


@dataclass(frozen=True, repr=False)
class HungResult:
    """A heap on threads. heap : the `SculptureResult` it was made of; hung : its threads and plate; swinging : in
    MuJoCo, for 5 s."""

    heap: Result
    hung: Hung
    swinging: Swinging

    @property
    def holds(self) -> bool:
        """Whether it hangs still."""
        return self.swinging.stays

    @property
    def warnings(self) -> list[str]:
        """In words, what to heed."""
        return [*self.heap.warnings, *self.hung.warnings, *([] if self.holds else [self.swinging.line()])]

    def headline(self) -> str:
        """What it is, in one line."""
        return f"{self.hung.line()}; {self.swinging.line()}"

    def table(self) -> dict[str, str]:
        """Its facts in words, for a small table."""
        found = self.hung
        rows = {
            "threads": f"{len(found.threads)} of {found.thread_mm:g} mm, {found.holes} of them to the plate",
            "plate": " x ".join(f"{edge:.0f}" for edge in found.plate_mm) + " mm",
            "scale": f"{found.scale / MILLIMETRES:.3g} of true size",
            "swinging": self.swinging.line(),
        }
        for camera, alike, share in zip(found.sculpture.cameras, found.likeness, found.of_ceiling, strict=True):
            rows[f"likeness {camera.direction}"] = f"{alike:.1%}, {share:.1%} of the ceiling"
        return rows

    def record(self) -> dict:
        """Its entry of result.json."""
        return {"hang": {**self.hung.to_dict(), "swinging": self.swinging.to_dict()}}

    @cached_property
    def plate(self) -> Body:
        """The plate with its holes, in metres, where the objects hang in print."""
        vertices, faces = surface_of(self.hung.plate)
        return make_body("plate", vertices / MILLIMETRES, faces)

    @cached_property
    def shown(self) -> tuple[list[Body], np.ndarray]:
        """Objects, plate and threads, which are drawn thick enough to be seen, and where they are, in metres."""
        found, scale, shift = self.hung, self.hung.scale / MILLIMETRES, self.hung.shift / MILLIMETRES
        true = np.diag([1 / scale] * 3 + [1.0])
        true[:3, 3] = -shift / scale
        radius = max(found.thread_mm, SHOWN_MM) / 2 / found.scale
        solids = [thread.solid(radius) for thread in found.threads]
        rods = [make_body(f"thread {k}", *surface_of(rod)) for k, rod in enumerate(solids, 1) if not rod.is_empty()]
        others = np.stack([true, *[np.eye(4)] * len(rods)])
        return [*self.heap.bodies, self.plate, *rods], np.concatenate([self.heap.matrices, others])

    def show(self, size: tuple[int, int] = (800, 700), **look) -> Image:
        """A picture in 3D. look : further arguments of `visualize.scene3d.Stage`, such as azimuth_deg."""
        from PIL import Image

        from ..visualize.scene3d import scene_picture

        return Image.fromarray(scene_picture(*self.shown, None, size, **look))

    def save(self, folder: str | Path, facts: Mapping | None = None, pictures: bool = False) -> Path:
        """The heap's run, as `SculptureResult.save`, and with it hung.3mf, the objects and the plate with its holes, in
        millimetres, and threads.csv, `Hung.write_table`."""
        files = {"hung.3mf": partial(write_3mf, parts=self._parts()), "threads.csv": self.hung.write_table}
        return self.heap.save(folder, self.record() | dict(facts or {}), pictures, files)

    def _parts(self) -> list[PlacedPart]:
        scale, shift, parts = self.hung.scale / MILLIMETRES, self.hung.shift / MILLIMETRES, []
        for body, matrix in zip(self.heap.bodies, self.heap.matrices, strict=True):
            pose = matrix.copy()
            pose[:3, 3] = scale * (matrix[:3, :3] @ body.centre + matrix[:3, 3]) + shift
            solid = scale * body.solid_vertices, body.solid_faces
            parts.append(PlacedPart(body.name, body.source, body.digest, *solid, pose, pose))
        plate, place = self.plate, np.eye(4)
        place[:3, 3] = plate.centre
        return [*parts, PlacedPart("plate", "", "plate", plate.solid_vertices, plate.solid_faces, place, place)]

    def __repr__(self) -> str:
        return f"<Hung: {self.headline()}>"

    def _repr_html_(self) -> str:
        from ..visualize.summary import picture_html, table_html

        return picture_html(*self.shown) + table_html(self.table())
