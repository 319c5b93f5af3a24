"""Heaps that are hung up: objects on threads below a plate, in millimetres, and what the views see of them.

A picture begins at its highest dark row, and the plate is above; threads are seen. What the views see is measured anew
with them.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import manifold3d
import numpy as np
import torch

from ..exact.placing import placed_solid
from ..geometry.cameras import Camera
from ..geometry.meshes import make_body
from ..geometry.silhouette_edges import Outlines, Views
from ..silhouettes import mask
from ..util.errors import InputError
from .building import PRINTER_MM, printer_volume
from .hiding import FARTHEST_WIDTHS
from .sculpture import Sculpture
from .threads import Thread, find_threads, surface_of

THREAD_MM = 0.2
PLATE_MM = 4.0  # thick
SHORT_MM = 1.0  # below which a thread is a drop of glue
RIM_MM = 5.0  # of the plate, about what hangs below
HOLE_SPARE_MM = 0.4  # by which a hole is wider than its thread
FINE_PIXELS = 2048  # along a picture, about: threads are thinner than its own
THINNER = 100.0  # times than the printer's least edge: the thickest thread
COLUMNS = "thread,object,x,y,z,ends at,end x,end y,end z,length mm,hole x mm,hole y mm,load share"


@dataclass(frozen=True)
class Hung:
    """A heap on threads.

    sculpture : the heap. threads : in its metres. scale : millimetres in a metre of the heap; shift `(3,)` : what is
    added to its scaled coordinates, so that it is about the middle of the plate, above z = 0. plate : with its holes,
    in these millimetres. plate_mm `(3,)` : its edges. images `(K, H, H)` in [0, 1]: what the views see, of a pixel
    beside the objects the share that threads cover.
    """

    sculpture: Sculpture
    threads: Sequence[Thread]
    scale: float
    shift: np.ndarray
    plate: manifold3d.Manifold
    plate_mm: np.ndarray
    images: np.ndarray
    thread_mm: float

    @property
    def likeness(self) -> np.ndarray:
        """`(K,)` intersection over union with the pictures."""
        return _alike(self.images, self.sculpture.pictures)

    @property
    def of_ceiling(self) -> np.ndarray:
        """`(K,)` intersection over union with the silhouettes of the pictures' visual hull."""
        return _alike(self.images, self.sculpture.hull)

    @property
    def single(self) -> list[str]:
        """Names of the objects that hang by one thread."""
        counts = np.bincount([thread.body for thread in self.threads], minlength=len(self.sculpture.bodies))
        return [body.name for body, count in zip(self.sculpture.bodies, counts, strict=True) if count == 1]

    @property
    def short(self) -> int:
        """How many threads are too short to be tied."""
        return sum(self.scale * thread.length < SHORT_MM for thread in self.threads)

    @property
    def holes(self) -> int:
        """How many threads end at the plate."""
        return sum(thread.above is None for thread in self.threads)

    @property
    def warnings(self) -> list[str]:
        """In words, what to heed."""
        lines = [f"one thread does not keep {', '.join(self.single)} from turning about it"] if self.single else []
        if self.short:
            lines.append(f"{self.short} threads are shorter than {SHORT_MM:g} mm; glue what they join")
        return lines

    def to_dict(self) -> dict:
        """As plain numbers, for `result.json`."""
        return {
            "threads": len(self.threads),
            "holes": self.holes,
            "short": self.short,
            "single": self.single,
            "thread_mm": self.thread_mm,
            "longest_mm": self.scale * max(thread.length for thread in self.threads),
            "plate_mm": self.plate_mm.tolist(),
            "mm_per_metre": self.scale,
            "shift_mm": self.shift.tolist(),
            "likeness": self.likeness.tolist(),
            "likeness_of_ceiling": self.of_ceiling.tolist(),
        }

    def line(self) -> str:
        """What it is, in words."""
        x, y, _ = self.plate_mm
        return (
            f"{len(self.sculpture.bodies)} objects on {len(self.threads)} threads of {self.thread_mm:g} mm, "
            f"{self.holes} through a plate of {x:.0f} x {y:.0f} mm, the others below objects, {self.scale / 1000:.3g} "
            f"of true size, likeness with threads {self.of_ceiling.min():.1%} of the ceiling at least"
        )

    def write_table(self, path: Path) -> None:
        """Write a row for each thread: where it is fixed on its object, and where it ends at another one, in metres of
        their files; its length; its hole, from the plate's middle; and its share of what its object carries."""
        matrices, names = self.sculpture.matrices, [body.name for body in self.sculpture.bodies]
        carried = np.zeros(len(names))
        np.add.at(carried, [thread.body for thread in self.threads], [thread.load for thread in self.threads])

        def on(body: int, place: np.ndarray) -> list[str]:
            matrix = matrices[body]
            return [f"{value:.6f}" for value in matrix[:3, :3].T @ (place - matrix[:3, 3])]

        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(COLUMNS.split(","))
            for number, thread in enumerate(self.threads, 1):
                hole = [f"{value:.2f}" for value in (self.scale * thread.high + self.shift)[:2]]
                if thread.above is None:
                    end = ["plate", "", "", ""]
                else:
                    end, hole = [names[thread.above], *on(thread.above, thread.high)], ["", ""]
                start = [names[thread.body], *on(thread.body, thread.low)]
                share = f"{thread.load / carried[thread.body]:.4f}"
                writer.writerow([number, *start, *end, f"{self.scale * thread.length:.2f}", *hole, share])


def hang(
    sculpture: Sculpture,
    printer_mm: Sequence[float] = PRINTER_MM,
    thread_mm: float = THREAD_MM,
    scale: float | None = None,
) -> Hung:
    """A heap's objects on threads, below a plate as large as a printer makes it.

    printer_mm : its volume, x, y, z; the plate fills x or y. scale : millimetres in a metre, if it is given. Raises
    InputError for lengths that are not positive, a plate that is larger than the printer or would stand before a view,
    and where no threads that cross nothing hold some objects in balance; it names them.
    """
    printer = check_thread(printer_mm, thread_mm)
    solids = [placed_solid(body, matrix) for body, matrix in zip(sculpture.bodies, sculpture.matrices, strict=True)]
    boxes = np.array([solid.bounding_box() for solid in solids])
    low, high = boxes[:, :3].min(0), boxes[:, 3:].max(0)
    largest = float(((printer[:2] - 2 * RIM_MM) / (high - low)[:2]).min())
    scale = largest if scale is None else scale
    edges = np.array([*scale * (high - low)[:2] + 2 * RIM_MM, PLATE_MM])
    if scale > largest * (1 + 1e-9) or printer[2] < PLATE_MM:
        raise InputError(
            f"the plate is {' x '.join(f'{edge:.0f}' for edge in edges)} mm and the printer's volume "
            f"{' x '.join(f'{edge:g}' for edge in printer)}; make the shadows smaller, or give a larger printer"
        )
    rim = np.array([RIM_MM, RIM_MM, 0]) / scale
    dark = sculpture.hull | (sculpture.images > 0.5)
    first = np.argmax(dark.any(2), axis=1)  # rows where pictures begin
    top = _plate_height(sculpture, first, low - rim, high + rim, PLATE_MM / scale)
    radius = thread_mm / 2 / scale
    beside = partial(_beside, sculpture.cameras, dark, first)
    threads, alone = find_threads(sculpture.bodies, sculpture.matrices, top, radius, beside)
    if alone:
        names = ", ".join(sculpture.bodies[i].name for i in alone[:5]) + (" and others" if len(alone) > 5 else "")
        raise InputError(
            f"no threads of {thread_mm:g} mm that cross nothing hold {names} in balance; ask for thinner ones, another "
            "seed, or --build"
        )
    shift = -scale * np.array([*(low + high)[:2] / 2, low[2]])
    block = manifold3d.Manifold.cube(edges).translate([*-edges[:2] / 2, scale * top + shift[2]])
    wide = (thread_mm + HOLE_SPARE_MM) / 2
    ends = [scale * thread.high + shift for thread in threads if thread.above is None]
    drill = manifold3d.Manifold.cylinder(3 * PLATE_MM, wide)
    holes = [drill.translate(end - [0, 0, PLATE_MM]) for end in ends]
    rods = manifold3d.Manifold.batch_boolean([thread.solid(radius) for thread in threads], manifold3d.OpType.Add)
    return Hung(
        sculpture=sculpture,
        threads=threads,
        scale=scale,
        shift=shift,
        plate=manifold3d.Manifold.batch_boolean([block, *holes], manifold3d.OpType.Subtract),
        plate_mm=edges,
        images=_seen(rods, sculpture, first),
        thread_mm=thread_mm,
    )


def check_thread(printer_mm: Sequence[float] = PRINTER_MM, thread_mm: float = THREAD_MM) -> np.ndarray:
    """`(3,)` a printer's volume. Raises InputError unless it and the thread are lengths that go together."""
    printer = printer_volume(printer_mm)
    if not 0 < thread_mm < printer.min() / THINNER:
        raise InputError(
            f"threads must be thicker than 0 and thinner than a hundredth of the printer's {printer.min():g} mm, "
            f"got {thread_mm:g} mm"
        )
    if printer[:2].min() <= 4 * RIM_MM:
        raise InputError(f"a plate needs {4 * RIM_MM:g} mm at least, got {printer[:2].min():g} mm")
    return printer


def _plate_height(sculpture: Sculpture, first: np.ndarray, low: np.ndarray, high: np.ndarray, thick: float) -> float:
    """The least height, metres, at which a plate over the box `low`, `high` `(3,)` is above all pictures, which begin
    at the rows `first` `(K,)`."""
    size, width = sculpture.hull.shape[-1], sculpture.cameras[0].width
    corners = np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (0.0, thick)])
    step = width / size
    for top in np.arange(high[2] + step, high[2] + FARTHEST_WIDTHS * width, step / 2):
        places = corners + np.array([0, 0, top])
        rows = [camera.pixels(places, size)[0].max() for camera in sculpture.cameras]
        if (np.array(rows) < first).all():
            return float(top)
    raise InputError("no plate stays above all pictures; give level views")


def _beside(cameras: Sequence[Camera], dark: np.ndarray, first: np.ndarray, points: np.ndarray) -> np.ndarray:
    """`(P,)` in how many views points `(P, 3)` lie beside what is `dark` `(K, H, H)`, below the rows `first` `(K,)`
    where pictures begin."""
    size, count = dark.shape[-1], np.zeros(len(points), int)
    for camera, picture, begin in zip(cameras, dark, first, strict=True):
        row, column = camera.pixels(points, size)
        within = (row >= begin) & (row < size) & (column >= 0) & (column < size)
        count += within & ~picture[row.clip(0, size - 1), column.clip(0, size - 1)]
    return count


def _seen(rods: manifold3d.Manifold, sculpture: Sculpture, first: np.ndarray) -> np.ndarray:
    """`(K, H, H)` in [0, 1]: what the views see of objects and threads, from where pictures begin; of a pixel beside
    the objects the share that threads cover."""
    images = (sculpture.images > 0.5).astype(np.float64)
    if rods.is_empty():
        return images
    body = make_body("threads", *surface_of(rods))
    outlines, turn, place = Outlines([body]), torch.eye(3)[None], torch.from_numpy(body.centre[None]).float()
    size = images.shape[-1]
    finer = max(1, FINE_PIXELS // size)
    for camera, begin, image in zip(sculpture.cameras, first, images, strict=True):
        fine = mask(outlines, turn, place, Views([camera]), finer * size).numpy()[0]
        threads = fine.reshape(size, finer, size, finer).mean((1, 3))
        image[begin:] = np.maximum(image, threads)[begin:]
        image[:begin] = 0
    return images


def _alike(images: np.ndarray, others: np.ndarray) -> np.ndarray:
    """`(K,)` intersection over union, of shares of pixels in the one `(K, H, H)`."""
    return np.minimum(images, others).sum((1, 2)) / np.maximum(images, others).sum((1, 2))
