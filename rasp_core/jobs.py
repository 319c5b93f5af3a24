"""Packings named by files and numbers alone: what the command line runs, and what a sweep sends to its workers."""

from __future__ import annotations

import time
from collections.abc import Sequence

from . import containers, dense, meshes, packing, spectral
from .containers import Container
from .errors import InputError
from .meshes import Body
from .problem import Settings
from .scene import resolve_device

METHODS = ("rasp", "dense", "spectral")


def load(
    objects: Sequence[str], container: str, repeat: int | None = None, fit_objects: int | None = None, seed: int = 0
) -> tuple[list[Body], Container, float]:
    """The pool, the container, and the factor on the objects' lengths.

    objects : mesh files or folders. container : `box:X,Y,Z` or a mesh file. repeat : draw a pool of so many with
    replacement. fit_objects : scale so that so many make half of the container. Raises InputError or MeshError.
    """
    room = containers.parse(container)
    bodies, scale = meshes.load_bodies(objects), 1.0
    if repeat is not None:
        bodies = packing.draw(bodies, repeat, seed)
    if fit_objects is not None:
        scale = packing.fit_scale(bodies, room, fit_objects)
        bodies = [body.scaled(scale) for body in bodies]
    return bodies, room, scale


def search(
    method: str,
    bodies: Sequence[Body],
    container: Container,
    count: int | None = None,
    settings: Settings | None = None,
    device="cpu",
    time_limit: float | None = None,
    effort: int | None = None,
    progress: bool = False,
) -> packing.Packing:
    """Pack by one of `METHODS`. Raises InputError where the method does not know a count or an effort that is given."""
    if method not in METHODS:
        raise InputError(f"method {method!r} is unknown; use one of {', '.join(METHODS)}")
    if count is not None and method != "rasp":
        raise InputError(f"method {method} chooses how many objects it packs; leave --count out, or use --method rasp")
    if effort is not None and method != "dense":
        raise InputError(f"method {method} has no effort; use --method dense")
    if method == "dense":
        return dense.pack(bodies, container, settings, device, time_limit, effort, progress)
    if method == "spectral":
        return spectral.pack(bodies, container, settings, device, time_limit, progress)
    return packing.pack(bodies, container, count, settings, device, time_limit, progress)


def pack(
    objects: Sequence[str],
    container: str,
    count: int | None = None,
    repeat: int | None = None,
    fit_objects: int | None = None,
    device: str = "cpu",
    method: str = "rasp",
    time_limit: float | None = None,
    effort: int | None = None,
    **settings,
) -> dict:
    """One packing's facts as plain values, for `sweep.sweep`; settings : of `problem.Settings`."""
    began = time.monotonic()
    chosen = Settings(**settings)
    bodies, room, _ = load(objects, container, repeat, fit_objects, chosen.seed)
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
