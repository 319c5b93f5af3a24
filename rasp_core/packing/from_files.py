"""Packings named by files and numbers alone: what the command line runs, and what a sweep sends to its workers."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence

from ..geometry import containers
from ..geometry.containers import Container, FreeBox
from ..geometry.items import bodies_of, item_of, read_table
from ..geometry.loading import METRES, Reading, load_bodies
from ..geometry.meshes import Body
from ..problem import Settings
from ..util.devices import resolve_device
from ..util.errors import InputError
from .methods import search
from .pool import draw, fit_scale


def load(
    objects: Sequence[str],
    container: str | Container,
    repeat: int | None = None,
    fit_objects: int | None = None,
    seed: int = 0,
    azimuths_deg: Sequence[float] | None = None,
    elevations_deg: Sequence[float] | None = None,
    reading: Reading = METRES,
    progress: bool = False,
    parts: str | None = None,
) -> tuple[list[Body], Container | FreeBox, float]:
    """The pool, the container, and the factor on the objects' lengths.

    objects : mesh files or folders, or words like `part.stl*12`. parts : a table of more, as `items.read_table` has it.
    container : as `containers.parse` has it, or made. repeat : draw a pool of so many with
    replacement. fit_objects : scale so that so many make half of the container. azimuths_deg, elevations_deg : of the
    views, one of each for every view; None for the paper's views. reading : what files and lengths mean.

    Raises InputError or MeshError.
    """
    room = containers.parse(container, reading) if isinstance(container, str) else container
    if (directions := directions_of(azimuths_deg, elevations_deg)) is not None:
        if isinstance(room, FreeBox):
            raise InputError(
                f"--azimuths-deg and --elevations-deg need a container that is given, got {container}; name its edges"
            )
        room = room.seen_from(directions)
    bodies, scale = _read(objects, parts, reading, progress), 1.0
    if repeat is not None:
        bodies = draw(bodies, repeat, seed)
    if fit_objects is not None:
        if isinstance(room, FreeBox):
            raise InputError("--fit-objects scales objects to a container; a box to be found has no size yet")
        scale = fit_scale(bodies, room, fit_objects)
        bodies = [body.scaled(scale) for body in bodies]
    return bodies, room, scale


def directions_of(
    azimuths_deg: Sequence[float] | None, elevations_deg: Sequence[float] | None
) -> list[tuple[float, float]] | None:
    """Azimuth and elevation in degrees of each view, None for the paper's. Raises InputError if not as many of both."""
    if azimuths_deg is None and elevations_deg is None:
        return None
    azimuths, elevations = list(azimuths_deg or ()), list(elevations_deg or ())
    if len(azimuths) != len(elevations):
        raise InputError(
            f"views need as many --azimuths-deg as --elevations-deg, got {len(azimuths)} and {len(elevations)}"
        )
    return list(zip(azimuths, elevations, strict=True))


def _read(objects: Sequence[str], parts: str | None, reading: Reading, progress: bool) -> list[Body]:
    items = [item_of(word) for word in objects]
    if parts is None and all(item.part == word for item, word in zip(items, objects, strict=True)):
        return load_bodies(objects, reading, progress)
    return bodies_of([*items, *(read_table(parts, reading) if parts is not None else ())], reading)


def pack(
    objects: Sequence[str],
    container: str,
    count: int | None = None,
    repeat: int | None = None,
    fit_objects: int | None = None,
    device: str = "cpu",
    method: str | None = None,
    time_limit: float | None = None,
    effort: int | None = None,
    parts: str | None = None,
    azimuths_deg: Sequence[float] | None = None,
    elevations_deg: Sequence[float] | None = None,
    reading: Mapping[str, str | bool] | None = None,
    clearance: float | None = None,
    wall_clearance: float | None = None,
    **settings,
) -> dict:
    """One packing's facts as plain values, for `sweep.sweep`; reading : fields of `loading.Reading`. settings : of
    `problem.Settings`.

    Raises InputError or MeshError as `load` and `search` do.
    """
    began = time.monotonic()
    chosen = Settings(**settings)
    bodies, room, _ = load(
        objects,
        container,
        repeat=repeat,
        fit_objects=fit_objects,
        seed=chosen.seed,
        azimuths_deg=azimuths_deg,
        elevations_deg=elevations_deg,
        reading=Reading(**(reading or {})),
        parts=parts,
    )
    packed = search(
        method,
        bodies,
        room,
        count=count,
        settings=chosen,
        device=resolve_device(device),
        time_limit=time_limit,
        effort=effort,
        clearance=clearance,
        wall_clearance=wall_clearance,
        unit=Reading(**(reading or {})).unit,
    )
    certificate = packed.certificate
    return {
        "objects": len(packed.chosen),
        "density": packed.density,
        "certified": certificate.holds,
        "worst_overlap": certificate.worst_overlap,
        "worst_protrusion": certificate.worst_protrusion,
        "iterations": len(packed.history),
        "seconds": time.monotonic() - began,
    }
