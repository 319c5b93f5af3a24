"""Anamorphic art, at the door: heaps that show a different picture from each side."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..art import anamorphic, texturing
from ..art.building import PRINTER_MM, THICKNESS_MM
from ..art.fitting import Bounds, Fitted, fit
from ..art.hanging import THREAD_MM
from ..art.room import Room
from ..art.sculpture import Sculpture
from ..art.targets import from_files, from_text
from ..art.views import cameras_for
from ..geometry.meshes import Body
from ..util.devices import resolve_device
from ..util.errors import InputError
from .in_room import InRoom, room_for
from .inputs import as_bodies
from .result import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from PIL.Image import Image

    from .build import BuiltResult
    from .hang import HungResult


@dataclass(frozen=True, repr=False)
class SculptureResult(Result):
    """One heap. art : its pictures, their visual hull, how the search went. painted : its colours, in_room : its lamps
    and shadows, fitted : how its pictures gave way, None if they did not."""

    art: Sculpture
    device: str
    painted: texturing.Painted | None = None
    in_room: InRoom | None = None
    fitted: Fitted | None = None

    @property
    def warnings(self) -> list[str]:
        """In words, where the pictures contradict each other."""
        return self.art.warnings

    def headline(self) -> str:
        """What it is, in one line."""
        views, ceiling = len(self.arrangement.cameras), self.art.ceiling.min()
        return (
            f"Sculpture of {len(self.bodies)} objects, {views} views, likeness {self.art.of_ceiling.min():.1%} of the "
            f"ceiling at least, ceiling {ceiling:.1%}; {'certified' if self.certificate.holds else 'NOT certified'}"
        )

    def table(self) -> dict[str, str]:
        """Its facts in words, for a small table."""
        rows = {"objects": str(len(self.bodies)), "certificate": self.verdict}
        for camera, likeness, ceiling in zip(
            self.arrangement.cameras, self.art.likeness, self.art.ceiling, strict=True
        ):
            rows[f"likeness {camera.direction}"] = f"{likeness:.1%} (ceiling {ceiling:.1%})"
        if self.painted is not None:
            rows["painted"] = self.paint_fit()
        if self.in_room is not None:
            rows["in the room"] = self.in_room.line()
        return rows

    def paint_fit(self) -> str:
        """How like the pictures the painted heap is, in its worst view."""
        return f"PSNR {self.painted.psnr.min():.1f} dB, SSIM {self.painted.ssim.min():.2f} at least"

    def record(self) -> dict:
        """Further entries of result.json."""
        facts = {"command": "art", **self.art.to_dict(), "device": self.device, "seconds": self.seconds}
        if self.painted is not None:
            facts |= {"psnr": self.painted.psnr.tolist(), "ssim": self.painted.ssim.tolist()}
        if self.in_room is not None:
            facts["room"] = self.in_room.to_dict()
        if self.fitted is not None:
            facts["fitted"] = self.fitted.to_dict()
        return facts

    def show(self, size: tuple[int, int] = (800, 700), **look) -> Image:
        """As `Result.show`, in its own colours if it is painted."""
        return super().show(size, **({"painted": self.painted} | look))

    def installation(self) -> np.ndarray:
        """`(H, W, 3)` uint8: the heap in a dark room, its shadows on the walls; in its own room if it has one."""
        from ..visualize.scene3d import installation

        return installation(self.arrangement) if self.in_room is None else self.in_room.picture()

    def build(self, printer_mm: Sequence[float] = PRINTER_MM, thickness_mm: float = THICKNESS_MM) -> BuiltResult:
        """One closed piece for a printer: the objects on a base, joined by struts that no view sees.

        printer_mm : its volume, x, y, z, which the piece fills; in a room the piece has the size that this asks for.
        thickness_mm : of struts and joints, at least. Raises InputError for lengths that are not positive, a base that
        would stand before a view or its lamp's shadow, a piece that is larger than the printer, and where no hidden
        strut reaches some of the objects.
        """
        from .build import built

        return built(self, printer_mm, thickness_mm)

    def hang(self, printer_mm: Sequence[float] = PRINTER_MM, thread_mm: float = THREAD_MM) -> HungResult:
        """The objects on threads, one or two each, straight up to a plate or to an object above, that cross nothing.

        printer_mm : its volume, x, y, z; the plate fills x or y; in a room it has the size that this asks for.
        thread_mm : how thick threads are. Raises InputError for lengths that are not positive, a plate that is larger
        than the printer or would stand before a view, and where no threads hold some of the objects in balance.
        """
        from .hang import hung

        return hung(self, printer_mm, thread_mm)

    def save(
        self,
        folder: str | Path,
        facts: Mapping | None = None,
        pictures: bool = False,
        files: Mapping[str, Callable[[Path], object]] | None = None,
    ) -> Path:
        """As `Result.save`, with the targets, and painted.png; pictures : also installation.png, turntable.gif, and
        heap.html, in which the heap is turned with the mouse; of a heap in a room also room.html, the sheet to set it
        up by. files : further files' names, and what writes each."""
        from .run_folder import save_run

        images = {f"target_{k + 1}.png": np.where(t, 0, 255).astype(np.uint8) for k, t in enumerate(self.art.pictures)}
        if self.painted is not None:
            images["painted.png"] = (255 * np.concatenate(self.painted.images, 1)).astype(np.uint8)
        if pictures:
            images["installation.png"] = self.installation()
        record = self.record() | dict(facts or {})
        place = save_run(
            folder,
            self.arrangement,
            self.certificate,
            record,
            images=images,
            painted=self.painted,
            pages=None if self.in_room is None else {"room.html": self.in_room.sheet()},
            files=files,
        )
        if pictures:
            self._save_moving(place)
        return place

    def _save_moving(self, folder: Path) -> None:
        from ..io.atomic_files import whole
        from ..visualize import gltf, scene3d

        with whole(folder / "turntable.gif") as part:
            scene3d.save_turntable(part, self.arrangement, self.painted)
        with whole(folder / "heap.html") as part:
            part.write_text(gltf.page(self.bodies, self.matrices, self.painted), encoding="utf-8")


class SculptureRow(Sequence[SculptureResult]):
    """Heaps in a row, one for each place in words of several letters. It shows, plots and saves as one result does."""

    def __init__(self, heaps: Sequence[SculptureResult]):
        self.heaps = tuple(heaps)

    def __len__(self) -> int:
        return len(self.heaps)

    def __getitem__(self, index):
        return self.heaps[index]

    def __iter__(self) -> Iterator[SculptureResult]:
        return iter(self.heaps)

    def __repr__(self) -> str:
        return f"<{len(self.heaps)} sculptures: {', '.join(heap.headline() for heap in self.heaps)}>"

    def _repr_html_(self) -> str:
        return "".join(heap._repr_html_() for heap in self.heaps)

    def show(self, size: tuple[int, int] = (400, 400), **look) -> Image:
        """The heaps side by side."""
        from PIL import Image

        return Image.fromarray(np.concatenate([np.asarray(heap.show(size, **look)) for heap in self.heaps], 1))

    def plot(self) -> list[Figure]:
        """A figure for each heap."""
        return [heap.plot() for heap in self.heaps]

    def save(self, folder: str | Path, facts: Mapping | None = None, pictures: bool = False) -> Path:
        """A run's folder for each heap, `1`, `2`, ... in a folder."""
        for number, heap in enumerate(self.heaps):
            heap.save(Path(folder) / f"{number + 1}", facts, pictures)
        return Path(folder)


def sculpt(
    parts: str | Path | Sequence[Body] | Sequence[str | Path],
    targets: Sequence[str | Path] | None = None,
    *,
    text: Sequence[str] | None = None,
    azimuths_deg: Sequence[float] | None = None,
    elevations_deg: Sequence[float] | None = None,
    projection: str = "orthographic",
    room: str | Path | Room | None = None,
    fit_targets: Sequence[float] | None = None,
    width: float | None = None,
    count: int | None = None,
    resolution: int = 512,
    time_limit: float | None = 120.0,
    paint: bool = False,
    seed: int = 0,
    device: str = "auto",
    progress: bool = False,
    each: Callable[[SculptureResult], object] | None = None,
) -> SculptureResult | SculptureRow:
    """Heap objects up, each as often as is wanted, so that each side shows another picture.

    targets : two to four picture files (alpha, or dark on a light ground), one for each view. text : words
    instead, one for each view; words of several letters make a `SculptureRow`, a heap for each place in the longest,
    over which a shorter one is stretched.
    azimuths_deg, elevations_deg : of the views; 0 and 90, or 0, 120, 240, or 0, 45, 90, 135, level, if None.
    room : instead of directions, a file of `art.room_file`, or a room: a lamp for each picture, and where its shadow
    falls; the result's `in_room` says what is to be seen there. fit_targets : by how much pictures may be shifted, of
    their edge, scaled, by one more or less, and turned, degrees, so that they agree better, such as (0.1, 0.15, 8).
    width : of the pictures in metres, chosen if None. count : objects, at most. resolution : pixels along a picture.
    time_limit : seconds after which no other width is tried. paint : the pictures' colours onto the heap.
    each : called with each heap as soon as it is made.

    Raises InputError unless targets or text is given, and for views or a room that do not match them.

    >>> import rasp_core as rasp
    >>> from data_fetch import kitchen_like
    >>> heap = rasp.sculpt(kitchen_like(4), text=["L", "T"], resolution=64, width=0.6, count=30)
    >>> heap.certificate.holds, len(heap.arrangement.cameras)
    (True, 2)
    """
    if (targets is None) == (text is None):
        raise InputError("a sculpture needs pictures (targets) or words (text); give one of them")
    if text is not None and paint:
        raise InputError("letters have no colours to paint with; give pictures (targets)")
    count_wanted = len(targets or text)
    if room is None:
        cameras = cameras_for(count_wanted, azimuths_deg, elevations_deg, width=width or 1.0, projection=projection)
    else:
        plain = azimuths_deg is None and elevations_deg is None and projection == "orthographic" and not paint
        room = room_for(room, count_wanted, plain)
        cameras = room.cameras()
    if targets is not None:
        wanted = [from_files(targets, resolution)]
    else:
        wanted = from_text(text, resolution, square=room is not None or any(camera.elevation_deg for camera in cameras))
    bounds = None if fit_targets is None else Bounds(*fit_targets)
    pool, chosen, heaps = as_bodies(parts), resolve_device(device), []
    for target in wanted:
        began = time.monotonic()
        seen = np.asarray if room is None else room.corrected
        fitted = None if bounds is None else fit(target.pictures, cameras, bounds, seen)
        if fitted is not None:
            colours = None if target.colours is None else fitted.apply(target.colours)
            target = replace(target, pictures=fitted.apply(target.pictures), colours=colours)
        made = anamorphic.sculpt(
            pool,
            seen(target.pictures),
            cameras,
            colours=target.colours if paint else None,
            count=count,
            width=width,
            seed=seed,
            device=chosen,
            time_limit=time_limit,
            progress=progress,
        )
        painted = texturing.paint(made, target.colours) if paint else None
        seconds = time.monotonic() - began
        placed = None if room is None else InRoom(room, made, target.pictures)
        heaps.append(
            SculptureResult(made.arrangement, made.certificate, seconds, made, str(chosen), painted, placed, fitted)
        )
        if each is not None:
            each(heaps[-1])
    return heaps[0] if len(heaps) == 1 else SculptureRow(heaps)
