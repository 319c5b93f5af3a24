"""Packings named by files and numbers alone: what the command line runs, and what a sweep sends to its workers."""

from __future__ import annotations

import time
from collections.abc import Sequence

from ..geometry import containers, meshes
from ..geometry.containers import Container, FreeBox
from ..geometry.meshes import Body
from ..problem import Settings
from ..util.devices import resolve_device
from ..util.errors import InputError
from . import constructive, dense, minimal_box, paper, result

METHODS = ("rasp", "dense", *constructive.RULES)


def load(
    objects: Sequence[str],
    container: str,
    repeat: int | None = None,
    fit_objects: int | None = None,
    seed: int = 0,
    azimuths_deg: Sequence[float] | None = None,
    elevations_deg: Sequence[float] | None = None,
) -> tuple[list[Body], Container | FreeBox, float]:
    """The pool, the container, and the factor on the objects' lengths.

    objects : mesh files or folders. container : as `containers.parse` has it. repeat : draw a pool of so many with
    replacement. fit_objects : scale so that so many make half of the container. azimuths_deg, elevations_deg : of the
    views, one of each for every view; None for the paper's views. Raises InputError or MeshError.
    """
    room = containers.parse(container)
    if azimuths_deg is not None or elevations_deg is not None:
        azimuths, elevations = list(azimuths_deg or ()), list(elevations_deg or ())
        if len(azimuths) != len(elevations) or isinstance(room, FreeBox):
            raise InputError(
                f"views need as many --azimuths-deg as --elevations-deg and a container that is given, got "
                f"{len(azimuths)} and {len(elevations)} for {container}"
            )
        room = Container(room.body, room.size, list(zip(azimuths, elevations, strict=True)))
    bodies, scale = meshes.load_bodies(objects), 1.0
    if repeat is not None:
        bodies = result.draw(bodies, repeat, seed)
    if fit_objects is not None:
        if isinstance(room, FreeBox):
            raise InputError("--fit-objects scales objects to a container; a box to be found has no size yet")
        scale = result.fit_scale(bodies, room, fit_objects)
        bodies = [body.scaled(scale) for body in bodies]
    return bodies, room, scale


def resolve_method(method: str | None, container: Container | FreeBox) -> str:
    """The method, where None the paper's, or the kit's own for a box to be found. Raises InputError where it is
    unknown, or cannot find a box."""
    method = method or ("dense" if isinstance(container, FreeBox) else "rasp")
    if method not in METHODS:
        raise InputError(f"method {method!r} is unknown; use one of {', '.join(METHODS)}")
    if method == "rasp" and isinstance(container, FreeBox):
        raise InputError("method rasp packs into a given container; name one, or use --method dense")
    return method


def search(
    method: str | None,
    bodies: Sequence[Body],
    container: Container | FreeBox,
    count: int | None = None,
    settings: Settings | None = None,
    device="cpu",
    time_limit: float | None = None,
    effort: int | None = None,
    progress: bool = False,
) -> result.Packing:
    """Pack by one of `METHODS`. Raises InputError as `resolve_method` does, and where the method does not know a count
    or an effort that is given."""
    method = resolve_method(method, container)
    if count is not None and method != "rasp":
        raise InputError(f"method {method} chooses how many objects it packs; leave --count out, or use --method rasp")
    if effort is not None and method != "dense":
        raise InputError(f"method {method} has no effort; use --method dense")
    if isinstance(container, FreeBox):
        rule = None if method == "dense" else method
        return minimal_box.pack(bodies, container, settings, device, time_limit, effort, progress, rule)
    if method == "dense":
        return dense.pack(bodies, container, settings, device, time_limit, effort, progress)
    if method in constructive.RULES:
        return constructive.pack(bodies, container, settings, device, time_limit, progress, method)
    return paper.pack(bodies, container, count, settings, device, time_limit, progress)


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
    azimuths_deg: Sequence[float] | None = None,
    elevations_deg: Sequence[float] | None = None,
    **settings,
) -> dict:
    """One packing's facts as plain values, for `sweep.sweep`; settings : of `problem.Settings`."""
    began = time.monotonic()
    chosen = Settings(**settings)
    views = azimuths_deg, elevations_deg
    bodies, room, _ = load(objects, container, repeat, fit_objects, chosen.seed, *views)
    packed = search(method, bodies, room, count, chosen, resolve_device(device), time_limit, effort)
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
