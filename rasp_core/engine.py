"""Which engine computes the hot loops: numba's compiled ones on the CPU, plain torch on every other device.

The torch versions are the oracles of the compiled ones; `use("torch")` has them everywhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import torch

from .errors import InputError

ENGINES = ("auto", "torch")
_chosen: ContextVar[str] = ContextVar("engine", default="auto")


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
