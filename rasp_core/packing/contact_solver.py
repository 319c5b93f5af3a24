"""Overlapping bodies pushed apart, all at once: the least of their surface contact, by a Levenberg-Marquardt method.

While Adam on the paper's losses wants hundreds of iterations, some tens of steps come to the least here, since a step
knows how stiff each contact is. Contact sees no picture and no query points, so this is for what packing needs: a
verdict, in hundredths of a second, on how nearly many bodies fit where they are put. On the CPU.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch

from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..geometry.sdf import GridStack
from ..geometry.surface_samples import SAMPLE_SPACING, surface_samples
from ..kernels import dispatch

BLOCK_SAMPLES = 8  # of a surface that are passed over together, at most


class Relaxed(NamedTuple):
    """What S starts came to: energy `(S,)`, m^4; rotation `(S, N, 3, 3)`, translation `(S, N, 3)`; energy_of_body
    `(S, N)`, each body's part of the energy."""

    energy: np.ndarray
    rotation: np.ndarray
    translation: np.ndarray
    energy_of_body: np.ndarray

    def of(self, start: int) -> Relaxed:
        """Of one start, without the first axis."""
        return Relaxed(*(values[start] for values in self))


class Relaxation:
    """Bodies to be pushed apart, any number of times.

    spacing : between surface samples, in cells of a body's grid. stack : the bodies' grids, if they are at hand.
    """

    def __init__(self, bodies: Sequence[Body], spacing: float = SAMPLE_SPACING, stack: GridStack | None = None):
        self.half = np.array([body.half_extents for body in bodies], np.float64)
        self.radius = np.array([body.radius for body in bodies], np.float64)
        self.grids = (stack or GridStack.of_bodies(bodies)).arrays
        self.samples = _in_blocks(bodies, spacing)

    @property
    def unit(self) -> float:
        """An energy to compare with, m^4: that of bodies whose whole surface overlaps by about a radius."""
        return float((self.radius**4).sum())

    def run(
        self,
        rotation: np.ndarray,
        translation: np.ndarray,
        container: Container,
        margin: float,
        ceiling: np.ndarray,
        weight: np.ndarray | None = None,
    ) -> Relaxed:
        """The least energies that are found from S starts, and the poses that have them.

        rotation `(S, N, 3, 3)`, translation `(S, N, 3)` : of the bodies' centres; float64, left as they are. margin :
        metres that each body keeps from the wall, and half of what it keeps from another. ceiling `(K,)` : energies; a
        start that is above its step's is given up, and after K steps all end. weight `(N,)` : by the mean of which what
        two bodies share counts, 1 if None.

        The energy is `surface_contact.contact`'s, the sum over surface samples of area times depth squared.
        """
        from ..kernels.levenberg_marquardt import relax

        rotation, translation = np.array(rotation, np.float64), np.array(translation, np.float64)
        energy, energy_of_body = np.zeros(len(rotation)), np.zeros(rotation.shape[:2])
        weight = np.ones_like(self.radius) if weight is None else weight
        scene = container.arrays(torch.float32), self.grids, self.samples, self.half, self.radius, weight
        ceiling = np.asarray(ceiling, np.float64)
        with dispatch.one_torch_thread(torch.device("cpu")):
            dispatch.in_parallel(relax, scene, rotation, translation, margin, ceiling, energy, energy_of_body)
        return Relaxed(energy, rotation, translation, energy_of_body)


def _in_blocks(bodies: Sequence[Body], spacing: float) -> tuple[np.ndarray, ...]:
    """Surface samples, block by block: points `(S, 3)` in body frames, area `(S,)` square metres; first `(B + 1,)` of
    each block's; centre `(B, 3)` and radius `(B,)` of a ball about them; first block `(N + 1,)` of each body."""
    samples = surface_samples(bodies, spacing=spacing)
    points, area = samples.points.numpy(), samples.area.numpy().astype(np.float64)
    known: dict[str, list[np.ndarray]] = {}
    rows, first_block = [], [0]
    for body, start, count in zip(bodies, samples.start.tolist(), samples.count.tolist(), strict=True):
        if body.digest not in known:
            known[body.digest] = list(_halved(points[start : start + count], np.arange(count)))
        rows += [start + block for block in known[body.digest]]
        first_block.append(len(rows))
    boxes = np.array([(points[row].min(0), points[row].max(0)) for row in rows], np.float64)
    centre = boxes.mean(1)
    radius = np.array([np.linalg.norm(points[row] - c, axis=1).max() for row, c in zip(rows, centre, strict=True)])
    first = np.cumsum([0, *map(len, rows)])
    order = np.concatenate(rows)
    return points[order], area[order], first, centre, radius, np.array(first_block)


def _halved(points: np.ndarray, rows: np.ndarray):
    """Blocks of nearby rows: halved across the longest edge of their box until they are small enough."""
    if len(rows) <= BLOCK_SAMPLES:
        yield rows
        return
    along = np.ptp(points[rows], axis=0).argmax()
    rows = rows[np.argsort(points[rows, along], kind="stable")]
    yield from _halved(points, rows[: len(rows) // 2])
    yield from _halved(points, rows[len(rows) // 2 :])
