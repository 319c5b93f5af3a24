"""What options of the command line must be; each check raises InputError naming the option and what is expected."""

from __future__ import annotations

import argparse

from ..util.errors import InputError

CLEARANCES = ("clearance", "wall_clearance")


def check_time(options: argparse.Namespace) -> None:
    """Seconds are positive."""
    if options.time_limit is not None and not options.time_limit > 0:
        raise InputError(f"--time-limit must be positive, got {options.time_limit}")


def check_clearances(options: argparse.Namespace) -> None:
    """Clearances are lengths, or none."""
    for name in CLEARANCES:
        length = getattr(options, name)
        if length is not None and not 0 <= length < float("inf"):
            raise InputError(f"--{name.replace('_', '-')} must be a length of 0 or more, got {length:g}")


def check_together(options: argparse.Namespace) -> None:
    """What is asked of one packing goes together."""
    if options.settle and options.boxes:
        raise InputError("--settle is of one box, and --boxes asks for several; settle each of them by its scene")
    if options.settle and options.fixed:
        raise InputError("--settle lets all objects fall, and those of --fixed stay; leave one of them out")
    if options.settle and options.gravity:
        raise InputError("--gravity lets objects fall while they are packed, --settle afterwards; ask for one of them")
    if options.record and options.gravity:
        raise InputError("--record shows the search, and --gravity moves what it found; leave one of them out")
    if options.record and (options.boxes or options.fixed):
        raise InputError("--record shows the objects of one box on their way; leave out --boxes and --fixed")


def table_of(options: argparse.Namespace) -> str | None:
    """The table of boxes, None where they are like the container."""
    table = options.boxes if options.boxes and options.boxes.lower().endswith(".csv") else None
    if table and (options.container or options.cavity):
        raise InputError(
            "--container and --cavity are of one kind of box, and the table of --boxes has all; leave them"
        )
    return table


def check_container(options: argparse.Namespace, table: str | None = None) -> None:
    """There is a container."""
    if options.container is None and table is None:
        raise InputError("--container is needed, such as --container box:0.3,0.2,0.2, a mesh, or auto:cube")


def count_of(text: str, option: str = "--count") -> int | None:
    """The number of objects, or what another option counts, None for `auto`."""
    if text == "auto":
        return None
    try:
        count = int(text)
    except ValueError:
        count = 0
    if count < 1:
        raise InputError(f"{option} must be auto or a positive number, got {text}")
    return count


def made_of(options: argparse.Namespace) -> tuple[str | None, dict]:
    """What a heap is to be made, "build" or "hang", None if nothing, and what that method of `SculptureResult` is
    asked."""
    made = "build" if options.build else "hang" if options.hang else None
    asked = {"printer_mm": options.printer, "thickness_mm": options.thickness, "thread_mm": options.thread}
    asked = {name: value for name, value in asked.items() if value is not None}
    if "thickness_mm" in asked and made != "build":
        raise InputError("--thickness is of a piece to build; add --build")
    if "thread_mm" in asked and made != "hang":
        raise InputError("--thread is of a heap to hang up; add --hang")
    if asked and made is None:
        raise InputError("--printer is of a piece to build, or of a plate to hang a heap up; add --build or --hang")
    if "printer_mm" in asked:
        asked["printer_mm"] = three(options.printer, "--printer must be three lengths in mm, as 200,200,200")
    return made, asked


def fit_of(options: argparse.Namespace) -> tuple[float, ...] | None:
    """By how much pictures may give way, None where they may not."""
    if options.fit_targets is None:
        return None
    return three(options.fit_targets, "--fit-targets must be a shift, a scale and degrees, as 0.1,0.15,8")


def three(text: str, expected: str) -> tuple[float, ...]:
    """Three numbers between commas; `expected` says what they are."""
    try:
        numbers = tuple(float(word) for word in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != 3:
        raise InputError(f"{expected}, got {text}")
    return numbers
