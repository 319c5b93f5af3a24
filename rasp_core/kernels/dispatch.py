"""Which engine computes the hot loops: numba's compiled ones on the CPU, plain torch on every other device.

The torch versions are the oracles of the compiled ones; `use("torch")` has them everywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache

import torch

from ..util.errors import InputError

ENGINES = ("auto", "torch")
_chosen: ContextVar[str] = ContextVar("engine", default="auto")
_workers: ContextVar[int] = ContextVar("workers", default=0)


def compiled(device: torch.device) -> bool:
    """True where the compiled loops are to be used for tensors on `device`."""
    return device.type == "cpu" and _chosen.get() == "auto"


@contextmanager
def use(name: str) -> Iterator[None]:
    """Within the block, "torch" everywhere or "auto" again. Raises InputError for another name."""
    if name not in ENGINES:
        raise InputError(f"engine {name!r} is unknown; use one of {', '.join(ENGINES)}")
    token = _chosen.set(name)
    try:
        yield
    finally:
        _chosen.reset(token)


def workers() -> int:
    """On how many threads `in_parallel` computes: as many as torch, or as torch had outside of `one_torch_thread`."""
    return _workers.get() or torch.get_num_threads()


@contextmanager
def one_torch_thread(device: torch.device) -> Iterator[None]:
    """Within the block torch itself computes on one thread, where the loops on `device` are the compiled ones.

    Torch's threads spin for some milliseconds after each operation that they share, on the cores that `in_parallel`
    wants.
    """
    before = torch.get_num_threads()
    if not compiled(device) or before == 1:
        yield
        return
    token = _workers.set(before)
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
        _workers.reset(token)


def in_parallel(kernel: Callable, *arguments) -> list:
    """`kernel(worker, workers, *arguments)` on each of `workers()` threads; their results in order.

    The compiled loops release the interpreter's lock. Plain threads and not numba's parallel loops: those take twice
    as long to compile.
    """
    count = workers()
    others = [_pool(count).submit(kernel, worker, count, *arguments) for worker in range(1, count)]
    return [kernel(0, count, *arguments), *(other.result() for other in others)]


@cache
def _pool(count: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(count - 1, thread_name_prefix="rasp")
