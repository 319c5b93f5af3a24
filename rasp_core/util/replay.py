"""Work that a GPU does again and again, recorded once as a CUDA graph and then played: no kernel waits for the CPU.

What is recorded must not ask the GPU for a number; its searches have a size that is known beforehand, see `capacity`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import torch
from torch import Tensor

from .capacity import Capacity

WARM_UPS = 2  # before work is recorded, so that libraries and autograd have what they allocate once

Results = tuple[Tensor | None, ...]


class Replay:
    """`work(row, variant)` on a GPU, played from records, one for each variant.

    work : takes a row of numbers that differ from play to play, `(C,)` on the GPU, and a variant; returns tensors.
    changes : all that it changes from one play to the next.
    """

    def __init__(self, work: Callable[[Tensor, bool], Results], columns: int, changes: Sequence[Tensor]):
        self.work, self.changes, self.capacity = work, list(changes), Capacity()
        self.row = torch.zeros(columns, device=changes[0].device, dtype=changes[0].dtype)
        self.records: dict[bool, tuple[torch.cuda.CUDAGraph, Results]] = {}

    def play(self, rows: Tensor, variants: Sequence[bool]) -> list[Results]:
        """The work for each of rows `(P, C)`, one after the other, and what each returned.

        Where a search found more than there was room for, all of it is done again with more room. At Ctrl-C it is as if
        none of it had been done.
        """
        while True:
            before = [tensor.detach().clone() for tensor in self.changes]
            try:
                results = [self._play(row, variant) for row, variant in zip(rows, variants, strict=True)]
            except KeyboardInterrupt:
                self._restore(before)
                raise
            if not self.capacity.exceeded():
                return results
            self._restore(before)
            self.records.clear()

    def _play(self, row: Tensor, variant: bool) -> Results:
        self.row.copy_(row)
        if variant not in self.records:
            self.records[variant] = self._record(variant)
        graph, results = self.records[variant]
        graph.replay()
        return tuple(None if result is None else result.detach().clone() for result in results)

    def _record(self, variant: bool) -> tuple[torch.cuda.CUDAGraph, Results]:
        before = [tensor.detach().clone() for tensor in self.changes]
        aside = torch.cuda.Stream()
        aside.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(aside), self.capacity.use():
            for _ in range(WARM_UPS):
                self.work(self.row, variant)
        torch.cuda.current_stream().wait_stream(aside)
        self._restore(before)
        graph = torch.cuda.CUDAGraph()
        with self.capacity.use(), torch.cuda.graph(graph):
            results = self.work(self.row, variant)
        return graph, results

    @torch.no_grad()
    def _restore(self, before: Sequence[Tensor]) -> None:
        for tensor, value in zip(self.changes, before, strict=True):
            tensor.copy_(value)
