"""What options of the command line mean: lengths in metres, the container, how files are read, the method.

Everything heavy is imported where it is used, so that a wrong argument is answered at once.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..util.errors import InputError

WEIGHTS = ("weighting", "shadow", "lambda_", "epsilon")  # options that are fields of `problem.Settings`
SETTINGS = (*WEIGHTS, "viewing_volume", "iterations", "resolution")
LENGTHS = {"epsilon", "width", "clearance", "wall_clearance"}  # options that are in the unit


def given_of(options: argparse.Namespace, *names: str) -> dict:
    """The options of these names that were given; lengths in metres."""
    values = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    for name in values.keys() & LENGTHS:
        value, metres = values[name], metres_of(options)
        values[name] = [one * metres for one in value] if isinstance(value, list) else value * metres
    return values


def metres_of(options: argparse.Namespace) -> float:
    """Of the unit."""
    from ..geometry.loading import Reading

    return Reading(options.unit).metres


def counted(count: int | None) -> dict:
    """The count as a setting, if there is one."""
    return {} if count is None else {"count": count}


def method_of(options: argparse.Namespace, given: dict) -> str:
    """The method, as named or by the container. Raises InputError if it would ignore a setting that is given."""
    from ..geometry import containers
    from ..packing import methods

    free = (options.container or "").split(":")[0] == "auto"
    box = containers.parse(options.container, reading_of(options)) if free else None
    method = methods.resolve_method(options.method, box)
    methods.refuse_ignored(method, given, box)
    return method


def container_of(options: argparse.Namespace, whole_path: bool = False) -> str:
    """The container's description, as `containers.parse` has it; whole_path : a mesh's from the root on."""
    from ..geometry.containers import CAVITY

    if options.container.split(":")[0] in ("box", "auto"):
        if options.cavity:
            raise InputError(f"--cavity needs a vessel's mesh, got {options.container}; leave it out")
        return options.container
    path = str(Path(options.container).resolve()) if whole_path else options.container
    return (CAVITY if options.cavity else "") + path


def reading_of(options: argparse.Namespace):
    """What files and lengths mean: a `loading.Reading`."""
    from ..geometry.loading import Reading

    return Reading(options.unit, options.repair, options.together, options.split)
