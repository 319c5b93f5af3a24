"""Packings named by files and numbers alone: what the command line runs, and what a sweep sends to its workers."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from functools import partial

import torch

from ..geometry import containers
from ..geometry.containers import Container, FreeBox
from ..geometry.items import bodies_of, item_of, read_table
from ..geometry.loading import METRES, Reading, load_bodies
from ..geometry.meshes import Body
from ..problem import Settings
from ..util.devices import resolve_device
from ..util.errors import InputError
from . import constructive, dense, minimal_box, paper
from .around import pack_apart
from .clearance import clearance_of
from .pool import check_sizes, draw, fit_scale
from .result import Packing

METHODS = ("paper", "dense", *constructive.RULES)

# What each method reads, by the names of `search` and `problem.Settings`. Methods take other settings, too, and do
# nothing with them; `refuse_ignored` says so.
READ_BY_ALL = frozenset({"seed", "resolution", "time_limit"})
USES: dict[str, frozenset[str]] = {
    "paper": READ_BY_ALL | {"count", "record"} | {field.name for field in fields(Settings)},
    "dense": READ_BY_ALL | {"effort", "query_points", "jitter", "overlap_term", "rotation"},
    **dict.fromkeys(constructive.RULES, READ_BY_ALL),
}
USES_FOR_A_BOX_TO_BE_FOUND = READ_BY_ALL | {"effort"}  # whatever the method
ONLY_WITH_COUNT = frozenset({"learning_rate", "final_learning_rate"})  # the paper's search has rates of its own
SETTINGS = frozenset({"count", "time_limit", "effort", "record"} | {field.name for field in fields(Settings)})
OPTIONS = {  # of the command line, by the setting's name
    "count": "--count",
    "time_limit": "--time-limit",
    "effort": "--effort",
    "record": "--record",
    "lambda_": "--lambda",
    "epsilon": "--epsilon",
    "weighting": "--weighting",
    "shadow": "--shadow",
    "viewing_volume": "--viewing-volume",
    "iterations": "--iterations",
    "resolution": "--resolution",
    "seed": "--seed",
}


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


def resolve_method(method: str | None, container: Container | FreeBox) -> str:
    """The method; if None the paper's, or the kit's own for a box to be found.

    Raises InputError if it is unknown, or cannot find a box.
    """
    method = method or ("dense" if isinstance(container, FreeBox) else "paper")
    if method not in METHODS:
        raise InputError(f"method {method!r} is unknown; use one of {', '.join(METHODS)}")
    if method == "paper" and isinstance(container, FreeBox):
        raise InputError("method paper packs into a given container; name one, or use --method dense")
    return method


def refuse_ignored(method: str, given: Mapping[str, object], container: Container | FreeBox | None = None) -> None:
    """Raise InputError naming every setting that the method would ignore.

    method : one of `METHODS`. given : the settings that the user gave, and only those, by the names in `SETTINGS`
    (count, effort, record, lambda_, ...); other names are left to others. container : with a `FreeBox`, all methods
    read the same few.
    """
    uses = USES_FOR_A_BOX_TO_BE_FOUND if isinstance(container, FreeBox) else USES[method]
    if "count" not in given:
        uses = uses - ONLY_WITH_COUNT
    ignored = [name for name in given if name in SETTINGS and name not in uses]
    if not ignored:
        return
    named = [f"{name.rstrip('_')} ({OPTIONS[name]})" if name in OPTIONS else name for name in ignored]
    remedy = "leave it out" if len(ignored) == 1 else "leave them out"
    if method == "paper" and ONLY_WITH_COUNT.issuperset(ignored):
        others = ["give a count (--count)"]
    elif isinstance(container, FreeBox):
        others = []
    else:
        others = [f"use --method {other}" for other in METHODS if USES[other].issuperset(ignored)]
    raise InputError(f"method {method} does not use {' and '.join(named)}; {', or '.join([remedy, *others[:1]])}")


def search(
    method: str | None,
    bodies: Sequence[Body],
    container: Container | FreeBox,
    count: int | None = None,
    settings: Settings | None = None,
    device: str | torch.device = "cpu",
    time_limit: float | None = None,
    effort: int | None = None,
    progress: bool = False,
    clearance: float | None = None,
    wall_clearance: float | None = None,
    unit: str = "m",
    fixed: Sequence[Body] = (),
    watch: Callable | None = None,
) -> Packing:
    """Pack by one of `METHODS`; None as `resolve_method` has it.

    settings : a method reads those that `USES` names; whether the others were given is not known here, so that callers
    ask `refuse_ignored` first. clearance : metres that bodies stay apart that wish no other; the larger of two counts.
    wall_clearance : metres from the wall, as much as between bodies if None. unit : of `loading.UNITS`, that errors are
    written in. fixed : bodies that lie in the container already, as `pack_apart` has them. watch : as `paper.pack` has
    it, who alone heeds it. Raises InputError as `resolve_method` does, for no bodies or one larger than the container,
    for a count, a time limit or an effort that the method would ignore, and as `pack_apart` and the method itself do.
    """
    method = resolve_method(method, container)
    given = {"count": count, "time_limit": time_limit, "effort": effort}
    refuse_ignored(method, {name: value for name, value in given.items() if value is not None}, container)
    _refuse_turns(method, bodies, container)
    largest = minimal_box.largest_box(bodies, container) if isinstance(container, FreeBox) else container
    check_sizes(bodies, largest, unit)
    apart = clearance_of([*bodies, *fixed], clearance, wall_clearance)
    if apart is not None or fixed:
        given.pop("time_limit")
        options = {"settings": settings, "device": device, "progress": progress, "watch": watch, "unit": unit}
        alone = partial(search, method, **options, **given)
        return pack_apart(alone, bodies, container, apart, fixed, device, time_limit, progress)
    if isinstance(container, FreeBox):
        return minimal_box.pack(
            bodies,
            container,
            settings=settings,
            device=device,
            time_limit=time_limit,
            effort=effort,
            progress=progress,
            rule=None if method == "dense" else method,
        )
    if method == "dense":
        return dense.pack(
            bodies,
            container,
            settings=settings,
            device=device,
            time_limit=time_limit,
            effort=effort,
            progress=progress,
        )
    if method in constructive.RULES:
        return constructive.pack(
            bodies,
            container,
            settings=settings,
            device=device,
            time_limit=time_limit,
            progress=progress,
            rule=method,
        )
    return paper.pack(
        bodies,
        container,
        count=count,
        settings=settings,
        device=device,
        time_limit=time_limit,
        progress=progress,
        watch=watch,
    )


def _refuse_turns(method: str, bodies: Sequence[Body], container: Container | FreeBox) -> None:
    """Raise InputError where a search turns bodies as it likes of which only some turns are wished."""
    if method == "dense" and isinstance(container, FreeBox):
        for body in bodies:
            if body.wishes.turns is not None:
                raise InputError(
                    f"{body.name}: turns {body.wishes.turns.word} are not kept by method dense in a box to be found; "
                    "use --method spectral, or give the box"
                )


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
