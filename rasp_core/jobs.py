"""Packings named by files and numbers alone: what the command line runs, and what a sweep sends to its workers."""

from __future__ import annotations

import time
from collections.abc import Sequence

from . import containers, meshes, packing
from .containers import Container
from .meshes import Body
from .problem import Settings
from .scene import resolve_device


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


def pack(
    objects: Sequence[str],
    container: str,
    count: int | None = None,
    repeat: int | None = None,
    fit_objects: int | None = None,
    device: str = "cpu",
    **settings,
) -> dict:
    """One packing's facts as plain values, for `sweep.sweep`; settings : of `problem.Settings`."""
    began = time.monotonic()
    chosen = Settings(**settings)
    bodies, room, _ = load(objects, container, repeat, fit_objects, chosen.seed)
    packed = packing.pack(bodies, room, count, chosen, resolve_device(device))
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
