"""Several boxes, of one kind or more: all parts in as few of them as are found, each a packing of its own."""

from __future__ import annotations

import csv
import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..geometry.containers import Container, FreeBox
from ..geometry.meshes import Body
from ..io.atomic_files import whole
from ..packing.boxes import Kind, fill_boxes, least_number
from ..packing.constructive import RULES
from ..packing.methods import SETTINGS, USES, refuse_ignored, resolve_method
from ..packing.pool import check_sizes, fitting
from ..util.errors import InputError
from .inputs import as_bodies, as_container
from .pack import PackingResult, pack, with_zones
from .run_folder import BOXES, BOXES_TABLE, box_folder, check_writable, forget

ONE = (str, Path, Container, FreeBox)  # what names one container
Counted = tuple[str | Path | Container, int | None]
PLACEMENT = "spectral"  # what boxes are filled by before a search refills them


@dataclass(frozen=True)
class BoxesResult:
    """Packings of one pool, a box each.

    packings : their `chosen` are indices into the whole pool. left : the bodies that are in none. least : as many boxes
    as volumes alone ask for. seconds : that all took. interrupted : whether Ctrl-C ended the search.
    """

    packings: list[PackingResult]
    left: list[Body]
    least: int
    seconds: float
    interrupted: bool = False

    def __len__(self) -> int:
        return len(self.packings)

    def __getitem__(self, number: int) -> PackingResult:
        return self.packings[number]

    def __iter__(self) -> Iterator[PackingResult]:
        return iter(self.packings)

    @property
    def certified(self) -> bool:
        """Whether every box is."""
        return all(packed.certificate.holds for packed in self.packings)

    @property
    def separable(self) -> bool:
        """Whether every box of which that was asked comes apart."""
        return all(packed.dismantling is None or packed.dismantling.holds for packed in self.packings)

    @property
    def resting(self) -> bool:
        """Whether every box of which that was asked stands by itself."""
        return all(packed.resting is None or packed.resting.holds for packed in self.packings)

    @property
    def missing(self) -> list[str]:
        """Names of the objects that must go in and did not."""
        return [body.name for body in self.left if body.wishes.must]

    @property
    def density(self) -> float:
        """Eq. 6 of all boxes together."""
        volumes = [packed.container.volume for packed in self.packings]
        return sum(p.density * v for p, v in zip(self.packings, volumes, strict=True)) / sum(volumes)

    def headline(self) -> str:
        """What it is, in one line."""
        objects, boxes = sum(len(packed.chosen) for packed in self), f"{len(self)} box{'es' * (len(self) > 1)}"
        verdict = "certified" if self.certified else "NOT certified"
        return f"{objects} of {objects + len(self.left)} objects in {boxes}, density {self.density:.4f}, {verdict}"

    def lines(self, unit: str = "m") -> list[str]:
        """Each box, its faults and its gaps in words, then what is in none; lengths in a unit of `loading.UNITS`."""
        told = []
        for number, packed in enumerate(self, 1):
            certificate, gaps = packed.certificate, packed.certificate.gaps
            told.append(f"box {number}: {len(packed.bodies)} objects, density {packed.density:.4f}")
            told += [f"box {number}: {line}" for line in certificate.lines(unit)[:20]]
            told += [] if packed.dismantling is None else [f"box {number}: {packed.dismantling.summary()}"]
            told += [] if packed.resting is None else [f"box {number}: {packed.resting.summary(unit)}"]
            told += [] if gaps is None else [f"box {number}: {gaps.summary(unit)}"]
        if self.left:
            told.append(f"in none of the boxes: {', '.join(body.name for body in self.left)}")
        if self.missing:
            told.append(f"must go in, but found no place: {', '.join(self.missing)}")
        return told

    def __repr__(self) -> str:
        return f"<{self.headline()}>"

    def to_dict(self) -> dict:
        """As plain values, for boxes.json."""
        return {
            "command": "pack",
            "boxes": [
                {
                    "folder": box_folder(number),
                    "container": packed.container.body.name,
                    "extent": np.ptp(packed.container.bounds, axis=0).tolist(),
                    "objects": len(packed.bodies),
                    "density": packed.density,
                    "certified": packed.certificate.holds,
                    "worst_overlap": packed.certificate.worst_overlap,
                    "worst_protrusion": packed.certificate.worst_protrusion,
                    "gaps": None if packed.certificate.gaps is None else packed.certificate.gaps.to_dict(),
                }
                for number, packed in enumerate(self.packings, 1)
            ],
            "least_by_volume": self.least,
            "density": self.density,
            "left": [body.name for body in self.left],
            "missing": self.missing,
            "seconds": self.seconds,
            "interrupted": self.interrupted,
        }

    def save(self, folder: str | Path, facts: dict | None = None, export: str = "") -> Path:
        """Write a run's folder for each box, box_1 and so on, then boxes.csv (which object is in which box) and
        boxes.json; the folders of boxes that an earlier run had more go. facts, export : as `PackingResult.save` has
        them. Raises InputError where it cannot be written.
        """
        folder = check_writable(folder)
        try:
            forget(folder)
            for number, packed in enumerate(self.packings, 1):
                packed.save(folder / box_folder(number), facts, export=export)
            with whole(folder / BOXES_TABLE) as part, part.open("w", newline="", encoding="utf-8") as file:
                writer = csv.writer(file)
                writer.writerow(["box", "name", "file"])
                for number, packed in enumerate(self.packings, 1):
                    writer.writerows([number, body.name, body.source] for body in packed.bodies)
            with whole(folder / BOXES) as part:
                part.write_text(json.dumps(self.to_dict(), indent=1) + "\n", encoding="utf-8")
        except OSError as error:
            raise InputError(f"{folder}: cannot be written ({error.strerror}); name another folder") from error
        return folder


def pack_boxes(
    parts: str | Path | Sequence[Body] | Sequence[str | Path],
    container: str | Path | Container | Sequence[str | Path | Container | Counted],
    method: str | None = None,
    *,
    boxes: int | None = None,
    time_limit: float | None = None,
    keep_out: str | Path | Sequence[Body] | Sequence[str | Path] = (),
    unit: str = "m",
    **options,
) -> BoxesResult:
    """Pack rigid objects into as few boxes as are found, each certified.

    parts, method, keep_out, unit : as `pack` has them. container : what all boxes are like, as `pack` has it, or
    several, in the order in which they are filled, each alone or with how many there are, None for as many as are
    needed; alone they are one each, and the last as many as are needed. boxes : so many at most, all together. What
    must go in goes into the first boxes, and what is too large for one into a later one.
    Boxes are filled by spectral placements, then refilled by the method as far as that gains. time_limit : seconds for
    refilling, all boxes together. options : the others of `pack` but count and fixed.

    Raises InputError as `pack` does, for a number of boxes below 1, no container, or a box to be found.

    >>> import rasp_core as rasp
    >>> from data_fetch import kitchen_like
    >>> rasp.pack_boxes(kitchen_like(5), rasp.box(0.15, 0.15, 0.12), "spectral")
    <5 of 5 objects in 2 boxes, density 0.2440, certified>
    """
    began = time.monotonic()
    if boxes is not None and boxes < 1:
        raise InputError(f"boxes must be 1 or more, or as many as are needed, got {boxes}")
    for name in ("count", "fixed"):
        if options.get(name):
            raise InputError(f"{name} is of one box, and several are asked for; leave one of them out")
    bodies = as_bodies(parts)
    rooms, counts = _counted(container)
    if not rooms or any(isinstance(room, FreeBox) for room in rooms):
        raise InputError("several boxes are of given kinds; give their edges, such as box:0.3,0.2,0.2")
    rooms = [with_zones(room, keep_out) for room in rooms]
    kinds = [Kind(room.volume, count, fitting(bodies, room)) for room, count in zip(rooms, counts, strict=True)]
    nowhere = [body for i, body in enumerate(bodies) if not any(i in kind.fitting for kind in kinds)]
    if nowhere or not bodies:
        check_sizes(nowhere, max(rooms, key=lambda room: room.volume), unit)

    method = resolve_method(method, rooms[0])
    shared = {name: value for name, value in options.items() if name not in SETTINGS or name in USES[PLACEMENT]}

    def place(some: Sequence[Body], kind: int) -> PackingResult:
        return pack(some, rooms[kind], method if method in RULES else PLACEMENT, unit=unit, **shared)

    def search(some: Sequence[Body], kind: int, seconds: float | None) -> PackingResult:
        return pack(some, rooms[kind], method, time_limit=seconds, unit=unit, **options)

    refuse_ignored(method, {name: value for name, value in options.items() if value is not None}, rooms[0])
    found, interrupted = fill_boxes(place, search, bodies, kinds, boxes, time_limit)
    packings = []
    for box in found:
        musts = [body.name for body in box.packed.bodies if body.wishes.must]
        packings.append(replace(box.packed, chosen=box.indices, pool=len(bodies), musts=musts))
    packed = {i for box in found for i in box.indices}
    left = [body for i, body in enumerate(bodies) if i not in packed]
    return BoxesResult(packings, left, least_number(bodies, kinds), time.monotonic() - began, interrupted)


def _counted(
    container: str | Path | Container | Sequence[str | Path | Container | Counted],
) -> tuple[list[Container | FreeBox], list[int | None]]:
    """The kinds of boxes, and how many there are of each."""
    given = [container] if isinstance(container, ONE) else list(container)
    pairs = [(one, 1 if k < len(given) else None) if isinstance(one, ONE) else one for k, one in enumerate(given, 1)]
    for _, count in pairs:
        if count is not None and count < 1:
            raise InputError(f"of each kind of box there are 1 or more, or None for as many as are needed, got {count}")
    return [as_container(one) for one, _ in pairs], [count for _, count in pairs]
