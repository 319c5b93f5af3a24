"""Some of a pool's objects and where they lie: what searches pass around and change step by step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch

from ..geometry.meshes import Body
from ..poses import Poses, join


@dataclass(frozen=True)
class Layout:
    """chosen : N indices into a pool. poses : of these objects' centres, in their order, metres, world."""

    chosen: list[int]
    poses: Poses

    @classmethod
    def empty(cls) -> Layout:
        """No objects."""
        return cls([], Poses(torch.zeros(0, 3, 3), torch.zeros(0, 3)))

    def __len__(self) -> int:
        return len(self.chosen)

    def bodies(self, pool: Sequence[Body]) -> list[Body]:
        """The objects themselves."""
        return [pool[index] for index in self.chosen]

    def take(self, positions: Sequence[int]) -> Layout:
        """Those at some positions in `chosen`."""
        return Layout([self.chosen[i] for i in positions], self.poses.take(positions))

    def without(self, position: int | None) -> Layout:
        """All but the one at a position in `chosen`; all if None."""
        return self.take([i for i in range(len(self)) if i != position])

    def added(self, index: int, pose: Poses) -> Layout:
        """With one more object of the pool, last."""
        return Layout([*self.chosen, index], join(self.poses, pose))
