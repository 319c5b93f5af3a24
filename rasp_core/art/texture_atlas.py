"""One texture for many triangles: each has a corner of a square block of texels of its own.

A triangle of n steps has texels at the barycentric lattice (i, j), i + j <= n: i steps from its first corner towards
its second, j towards its third. Between them colours are linear, as a viewer's bilinear filter draws them, for which
the texel across each diagonal is set too.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Atlas:
    """steps `(F,)` int: of each triangle. size : texels along the texture. corner `(F, 2)` int: row and column of each
    triangle's block."""

    steps: np.ndarray
    size: int
    corner: np.ndarray

    @classmethod
    def of(cls, steps: np.ndarray) -> Atlas:
        """Blocks in rows of equal height, the highest first, in a square."""
        edges, order = steps + 1, np.argsort(-steps, kind="stable")
        size = int(np.ceil(np.sqrt((edges.astype(float) ** 2).sum()) * 1.02)) + int(edges.max())
        while True:
            corner, row, column, high = np.zeros((len(steps), 2), int), 0, 0, int(edges.max())
            for edge in np.unique(edges)[::-1]:
                same = order[edges[order] == edge]
                if column:  # lower blocks begin a row of their own
                    row, column = row + high, 0
                high, across = int(edge), size // int(edge)
                number = np.arange(len(same))
                corner[same] = np.column_stack([row + number // across * edge, number % across * edge])
                row, column = row + int((len(same) - 1) // across) * int(edge), 1
            if row + high <= size:
                return cls(steps, size, corner)
            size += int(edges.max())

    @cached_property
    def first(self) -> np.ndarray:
        """`(F + 1,)`: the number of each triangle's first texel; those of one triangle follow, row by row of i."""
        return np.append(0, ((self.steps + 1) * (self.steps + 2) // 2).cumsum())

    @cached_property
    def lattice(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Triangle, i and j of every texel, each `(T,)`."""
        face = np.repeat(np.arange(len(self.steps)), np.diff(self.first))
        i, j = np.zeros(len(face), int), np.zeros(len(face), int)
        for n in np.unique(self.steps):
            steps = [(a, b) for a in range(n + 1) for b in range(n + 1 - a)]
            at = (self.first[:-1][self.steps == n][:, None] + np.arange(len(steps))).ravel()
            i[at], j[at] = np.tile(steps, (len(at) // len(steps), 1)).T
        return face, i, j

    def number(self, face: np.ndarray, i: np.ndarray, j: np.ndarray) -> np.ndarray:
        """The number of the texel (i, j) of a triangle."""
        return self.first[face] + i * (self.steps[face] + 1) - i * (i - 1) // 2 + j

    def weights(self, face: np.ndarray, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Texels `(P, 3)` and weights `(P, 3)` of points at barycentric u, v of the second and third corner."""
        n = self.steps[face]
        x, y = np.clip(u, 0, 1) * n, np.clip(v, 0, 1) * n
        i = np.minimum(x.astype(int), n - 1)
        j = np.minimum(y.astype(int), n - 1 - i).clip(0)
        fx, fy = x - i, y - j
        upper = (fx + fy > 1) & (i + j < n - 1)
        first = np.where(upper, self.number(face, i + upper, j + upper), self.number(face, i, j))
        texels = np.stack([first, self.number(face, i + 1, j), self.number(face, i, j + 1)], 1)
        low = np.stack([1 - fx - fy, fx, fy], 1)
        return texels, np.where(upper[:, None], np.stack([fx + fy - 1, 1 - fy, 1 - fx], 1), low)

    def edges(self) -> np.ndarray:
        """`(E, 2)` neighbouring texels within triangles."""
        face, i, j = self.lattice
        inner = i + j < self.steps[face]
        here, face, i, j = np.flatnonzero(inner), face[inner], i[inner], j[inner]
        right, up = self.number(face, i + 1, j), self.number(face, i, j + 1)
        return np.concatenate([np.stack(pair, 1) for pair in ((here, right), (here, up), (right, up))])

    def texture(self, colours: np.ndarray) -> np.ndarray:
        """Colours `(T, 3)` in [0, 1] as an image `(size, size, 3)` uint8, row 0 on top."""
        image = np.full((self.size, self.size, 3), 0.5)
        face, i, j = self.lattice
        image[self.corner[face, 0] + j, self.corner[face, 1] + i] = colours
        inner = i + j == self.steps[face] - 1
        face, i, j = face[inner], i[inner], j[inner]
        right, up, here = (self.number(face, *step) for step in ((i + 1, j), (i, j + 1), (i, j)))
        across = colours[right] + colours[up] - colours[here]
        image[self.corner[face, 0] + j + 1, self.corner[face, 1] + i + 1] = across
        return (255 * np.clip(image, 0, 1) + 0.5).astype(np.uint8)

    @cached_property
    def uv(self) -> np.ndarray:
        """`(F, 3, 2)`: texture coordinates of the triangles' corners, u to the right and v up."""
        row, column = self.corner.T[:, :, None] + np.zeros((2, 1, 3))
        column = column + self.steps[:, None] * np.array([0, 1, 0]) + 0.5
        row = row + self.steps[:, None] * np.array([0, 0, 1]) + 0.5
        return np.stack([column, self.size - row], -1) / self.size
