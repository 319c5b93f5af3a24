"""The device that a run is asked to use, and how a GPU does several things at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import cache

import torch

from .errors import InputError


def resolve_device(name: str | torch.device) -> torch.device:
    """`auto` (a GPU where there is one), `cpu`, `cuda`, `cuda:1`, `mps`. Raises InputError where it is not there."""
    if str(name) == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    try:
        device = torch.device(name)
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError, NotImplementedError) as error:
        raise InputError(f"device {str(name)!r} is not available here; use auto or cpu") from error
    return device


@contextmanager
def side_by_side(device: torch.device, name: str) -> Iterator[Callable[[], AbstractContextManager]]:
    """`with side_by_side(device, name) as aside`: on a GPU, what is done in a block `with aside():` does not wait for
    what is done beside it within the outer block, nor the other way round. At its end all of it is waited for.

    name : of the work; what is nested in other work needs another one."""
    if device.type != "cuda":
        yield nullcontext
        return
    main, used = torch.cuda.current_stream(device), []

    def aside() -> AbstractContextManager:
        stream = _stream(device, name, len(used))
        stream.wait_event(begin)
        used.append(stream)
        return torch.cuda.stream(stream)

    begin = main.record_event()
    try:
        yield aside
    finally:
        for stream in used:
            main.wait_stream(stream)


@cache
def _stream(device: torch.device, name: str, number: int) -> torch.cuda.Stream:
    return torch.cuda.Stream(device)
