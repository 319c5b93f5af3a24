"""Sculptures that can be built, at the door: one closed piece on a base, for a printer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..art.building import Built, build
from ..art.hiding import steep
from ..geometry.meshes import Body, make_body
from ..io.exports import MILLIMETRES, PlacedPart, write_3mf, write_stl
from ..physics.standing import Standing, stand
from ..util.errors import InputError
from .result import Result

if TYPE_CHECKING:
    from PIL.Image import Image


def built(heap: Result, printer_mm: Sequence[float], thickness_mm: float) -> BuiltResult:
    """A `SculptureResult` as one piece, as its `build` says."""
    scale = None
    if heap.in_room is not None:
        for throw, camera in zip(heap.in_room.room.throws, heap.cameras, strict=True):
            if steep(camera):
                raise InputError(
                    f"a base would stand between the lamp at {throw.at.tolist()} and the {throw.surface.name}; "
                    "hang the heap up, or move the lamp lower"
                )
        scale = MILLIMETRES * heap.in_room.scale
    piece = build(heap.art, printer_mm, thickness_mm, scale)
    return BuiltResult(heap, piece, stand(piece.vertices, piece.faces))


@dataclass(frozen=True, repr=False)
class BuiltResult:
    """A heap made one closed piece. heap : the `SculptureResult` it was made of; built : the piece; standing : on a
    floor, for 5 s."""

    heap: Result
    built: Built
    standing: Standing

    @property
    def holds(self) -> bool:
        """Whether it stands."""
        return self.standing.stands

    @cached_property
    def body(self) -> Body:
        """The piece, in metres, on z = 0."""
        return make_body("built", self.built.vertices / MILLIMETRES, self.built.faces)

    @property
    def warnings(self) -> list[str]:
        """In words, what to heed."""
        return [*self.heap.warnings, *self.built.warnings, *([] if self.holds else [self.standing.line()])]

    def headline(self) -> str:
        """What it is, in one line."""
        return f"{self.built.line()}; {self.standing.line()}"

    def table(self) -> dict[str, str]:
        """Its facts in words, for a small table."""
        built = self.built
        rows = {
            "one closed piece": " x ".join(f"{edge:.0f}" for edge in built.size_mm) + " mm",
            "scale": f"{built.scale / MILLIMETRES:.3g} of true size",
            "hidden struts": f"{len(built.struts)}, {built.thickness_mm:g} mm thick at least",
            "standing": self.standing.line(),
        }
        for camera, alike, share in zip(built.sculpture.cameras, built.likeness, built.of_ceiling, strict=True):
            rows[f"likeness {camera.direction}"] = f"{alike:.1%}, {share:.1%} of the ceiling"
        return rows

    def record(self) -> dict:
        """Its entry of result.json."""
        return {"build": {**self.built.to_dict(), "standing": self.standing.to_dict()}}

    def show(self, size: tuple[int, int] = (800, 700), **look) -> Image:
        """A picture in 3D. look : further arguments of `visualize.scene3d.Stage`, such as azimuth_deg."""
        from PIL import Image

        from ..visualize.scene3d import scene_picture

        return Image.fromarray(scene_picture([self.body], np.eye(4)[None], None, size, **look))

    def save(self, folder: str | Path, facts: Mapping | None = None, pictures: bool = False) -> Path:
        """The heap's run, as `SculptureResult.save`, and with it built.stl and built.3mf, in millimetres."""
        centre = np.eye(4)
        centre[:3, 3] = self.body.centre
        piece = PlacedPart("built", "", "built", self.body.solid_vertices, self.body.solid_faces, centre, centre)
        files = {"built.stl": partial(write_stl, parts=[piece]), "built.3mf": partial(write_3mf, parts=[piece])}
        return self.heap.save(folder, self.record() | dict(facts or {}), pictures, files)

    def __repr__(self) -> str:
        return f"<Built: {self.headline()}>"

    def _repr_html_(self) -> str:
        from ..visualize.summary import picture_html, table_html

        return picture_html([self.body], np.eye(4)[None]) + table_html(self.table())
