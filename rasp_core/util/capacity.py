"""Searches in plain torch whose results have a size that is known beforehand: no GPU is asked how many it found.

Outside of `Capacity.use` they find as many as there are; on a GPU the CPU then waits for each of them. Within it, what
they return has room for half as many again as the first call of that name found, and they say which entries are real.
Nothing is lost without notice: `Capacity.exceeded` tells whether any call found more than there was room for.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import torch
from torch import Tensor

SLACK, LEAST = 1.5, 4096  # room for so many times what was found, and for so many more

_present: ContextVar[Capacity | None] = ContextVar("capacity", default=None)


class Capacity:
    """Room for the results of searches, by their names."""

    def __init__(self):
        self.sizes: dict[str, int] = {}
        self.most: dict[str, Tensor] = {}  # that was needed so far, on the device

    @contextmanager
    def use(self) -> Iterator[None]:
        """Within the block the searches of this thread have this capacity."""
        token = _present.set(self)
        try:
            yield
        finally:
            _present.reset(token)

    def room(self, name: str, needed: Tensor) -> int:
        """How many entries the search of this name returns; needed : `()` int64, how many it found."""
        if name not in self.sizes:
            self.sizes[name] = _with_slack(int(needed))
            self.most[name] = torch.zeros_like(needed)
        self.most[name].copy_(torch.maximum(self.most[name], needed))
        return self.sizes[name]

    def exceeded(self) -> bool:
        """Whether a search found more than there was room for; there is room from now on. Waits for the device."""
        if not self.sizes:
            return False
        needed = dict(zip(self.most, torch.stack(list(self.most.values())).tolist(), strict=True))
        short = {name: _with_slack(count) for name, count in needed.items() if count > self.sizes[name]}
        self.sizes.update(short)
        return bool(short)


def found(mask: Tensor, name: str) -> tuple[Tensor, Tensor | None]:
    """Where `mask` `(M,)` is True, in order: indices, and which of them are real `(M',)` bool, None where all are.

    The others are 0.
    """
    capacity = _present.get()
    if capacity is None:
        return mask.nonzero()[:, 0], None
    count = mask.sum()
    size = capacity.room(name, count)
    index = torch.nonzero_static(mask, size=size, fill_value=0)[:, 0]
    return index, torch.arange(size, device=mask.device) < count


def ranges(start: Tensor, count: Tensor, name: str) -> tuple[Tensor, Tensor, Tensor | None]:
    """The indices in ranges `[start, start + count)`: which range each one is of, the index, and which of them are real
    as `found` has it. The others are the first of some range."""
    ends = count.cumsum(0)
    capacity = _present.get()
    if capacity is None:
        which, real = torch.repeat_interleave(count), None
        place = torch.arange(len(which), device=count.device) - (ends - count)[which]
    else:
        item = torch.arange(capacity.room(name, ends[-1]), device=count.device)
        real = item < ends[-1]
        which = torch.searchsorted(ends, item, right=True).clamp(max=len(count) - 1)
        place = only(real, item - (ends - count)[which])
    return which, start[which] + place, real


def only(real: Tensor | None, values: Tensor) -> Tensor:
    """`values` `(M, ...)`, and 0 or False for those that are not real."""
    if real is None:
        return values
    real = real.view(-1, *[1] * (values.dim() - 1))
    return values & real if values.dtype == torch.bool else torch.where(real, values, 0)


def _with_slack(count: int) -> int:
    return int(SLACK * count) + LEAST
