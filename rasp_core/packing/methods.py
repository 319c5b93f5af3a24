"""The methods of packing by their names, and which settings each of them reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from functools import partial

import torch

from ..geometry.containers import Container, FreeBox
from ..geometry.meshes import Body
from ..problem import Settings
from ..util.errors import InputError
from . import constructive, dense, minimal_box, paper
from .around import pack_apart
from .clearance import clearance_of
from .pool import check_sizes
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
    separable: bool = False,
) -> Packing:
    """Pack by one of `METHODS`; None as `resolve_method` has it.

    settings : a method reads those that `USES` names; whether the others were given is not known here, so that callers
    ask `refuse_ignored` first. clearance : metres that bodies stay apart that wish no other; the larger of two counts.
    wall_clearance : metres from the wall, as much as between bodies if None. unit : of `loading.UNITS`, that errors are
    written in. fixed : bodies that lie in the container already, as `pack_apart` has them. watch : as `paper.pack` has
    it, who alone heeds it. separable : as `minimal_box.pack` has it, who alone heeds it. Raises InputError as
    `resolve_method` does, for no bodies or one larger than the container, for a count, a time limit or an effort that
    the method would ignore, and as `pack_apart` and the method itself do.
    """
    method = resolve_method(method, container)
    given = {"count": count, "time_limit": time_limit, "effort": effort}
    refuse_ignored(method, {name: value for name, value in given.items() if value is not None}, container)
    largest = minimal_box.largest_box(bodies, container) if isinstance(container, FreeBox) else container
    check_sizes(bodies, largest, unit)
    apart = clearance_of([*bodies, *fixed], clearance, wall_clearance)
    if apart is not None or fixed:
        given.pop("time_limit")
        shown = {"progress": progress, "watch": watch, "unit": unit}
        alone = partial(search, method, settings=settings, device=device, separable=separable, **shown, **given)
        return pack_apart(alone, bodies, container, apart, fixed, device, time_limit, progress, unit)
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
            separable=separable,
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
