"""Guided local search among voxels: objects in a box too small for all are moved one by one to where they share least.

Each move tries the object in all right-angled turns at all shifts of a coarse lattice, by one Fourier correlation with
what the others take, and goes downhill from the best on the fine one, by the cube roots of what it shares with each.
That weighs more the longer two share something (Voudouris & Tsang 1999; Egeblad et al. 2007 pack by it; Gardeyn et al.
2025 in two dimensions, sparrow, arXiv 2509.13329, whose weights these are). Voxels count where their middle lies in an
object, so that those of a packing are neither too large nor too small in the mean, and surfaces may overlap by a part
of a voxel: `compaction` takes that out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import fft

from ..geometry.containers import FreeBox
from ..geometry.meshes import Body
from ..geometry.zones import distance_to
from ..kernels import voxel_runs
from .pool import kind
from .voxel_bodies import VoxelBody, filled, in_runs, laid_out, whole, without_overhangs
from .voxel_correlation import Turned, straight


@dataclass(frozen=True)
class VoxelSearchTuning:
    """What the search was tuned to."""

    places: int = 128  # of the coarse lattice that are looked at on the fine one
    refined: int = 8  # of these, from which a move goes downhill
    heavier_at_least: float = 1.2  # times: the weight of two that share something
    heavier_at_most: float = 2.0  # of the two that share most
    lighter: float = 0.95  # times: that of two that share nothing, down to 1
    heaviest: float = 1e8
    zones_wider: float = 0.5  # voxels, so that thin ones are seen
    same_turn: float = 1e-6  # of a rotation matrix: differences that are none


TUNING = VoxelSearchTuning()
CELL = 4  # voxels


class VoxelSearch:
    """Bodies in a box of voxels that is made smaller and smaller.

    voxel : its edge in metres. random : draws orders, swaps, and the edge that shrinks. cell : edge of the coarse
    lattice's cells, in voxels. separable : what lies under an overhang counts as taken, so that the bodies come out
    through the top. After `begin`: size `(3,)`, the box in voxels, and of each body turn `(N,)`, which of
    the turned bodies it is, and shift `(N, 3)`, where its first voxel lies. Where the box has zones, they are one more
    body that stays, the last.
    """

    def __init__(
        self,
        bodies: Sequence[Body],
        shape: FreeBox,
        voxel: float,
        random: np.random.Generator,
        cell: int = CELL,
        separable: bool = False,
    ) -> None:
        self.bodies, self.shape, self.voxel, self.random, self.cell = list(bodies), shape, voxel, random, cell
        self.separable = separable
        self._turns: list[VoxelBody] = []
        known: dict[tuple, list[int]] = {}
        for body in self.bodies:
            if kind(body) not in known:
                known[kind(body)] = self._add([self._taken(turned) for turned in straight(body, voxel, filled)])
        self._choices = [known[kind(body)] for body in self.bodies]
        self._zones: np.ndarray | None = None  # of the box, from its floor up to a height that was needed

    def begin(self, rotation: np.ndarray, translation: np.ndarray, edges: np.ndarray) -> None:
        """Bodies at poses `(N, 3, 3)`, `(N, 3)` in a box of these edges about the origin, all in metres."""
        self._turns = self._turns[: 1 + max(max(choices) for choices in self._choices)]
        self.turn = np.empty(len(self.bodies), np.int64)
        for i, (body, turned) in enumerate(zip(self.bodies, rotation, strict=True)):
            near = [k for k in self._choices[i] if np.abs(self._turns[k].rotation - turned).max() < TUNING.same_turn]
            self.turn[i] = near[0] if near else self._add([self._across(body, turned)])[0]
        corners = translation - np.array([self._turns[k].centre for k in self.turn]) + edges / 2
        self.shift = np.rint(corners / self.voxel).astype(np.int64)
        lengths = np.array([body.volume for body in self.bodies]) ** (1 / 3)
        if self.shape.zones:
            self.turn, self.shift = np.append(self.turn, len(self._turns)), np.append(self.shift, [[0, 0, 0]], axis=0)
            lengths = np.append(lengths, lengths.mean())
        self._sizes = np.array([turned.size for turned in self._turns])
        self._voxels = None
        # what two share counts more the larger they are, as that takes a longer way to undo
        self._lengths = np.sqrt(np.outer(lengths, lengths)).astype(np.float32) / np.float32(lengths.mean())
        self.forget()
        size = whole(edges, self.voxel)
        for i in self._sticking_out(size):
            fitting = self._fitting(i, size)
            self.turn[i] = fitting[0] if fitting else self.turn[i]
        self._enter(size)

    def sweep(self) -> float:
        """Move each body that shares something, in a random order; how much is overlapped then, 0 if nothing is."""
        shared = self._shared() if self._left is None else self._left
        for i in self.random.permutation(np.flatnonzero(shared[: len(self.bodies)].any(1))):
            self._move(i)
        self._left = self._shared()
        overlap = self._lengths * self._left.astype(np.float32) ** voxel_runs.POWER
        if most := overlap.max():
            heavier = TUNING.heavier_at_least + (TUNING.heavier_at_most - TUNING.heavier_at_least) * overlap / most
            heavier = np.minimum(self.weights * heavier, TUNING.heaviest)
            lighter = np.maximum(self.weights * TUNING.lighter, 1)
            self.weights = np.where(overlap > 0, heavier, lighter).astype(np.float32)
        return float(overlap.sum()) / 2

    def shrink(self) -> bool:
        """A box smaller by a voxel along a free edge, or along all of a cube; False if a body would not go in."""
        free = np.flatnonzero(self.shape.free)
        for shorter in [free] if self.shape.cube else self.random.permutation(free):
            size = self.size.copy()
            size[shorter] -= 1
            fitting = {i: self._fitting(i, size) for i in self._sticking_out(size)}
            if all(fitting.values()):
                for i, turns in fitting.items():
                    self.turn[i] = self.random.choice(turns)
                self._enter(size)
                return True
        return False

    def state(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where the bodies are, to be restored."""
        return self.turn.copy(), self.shift.copy(), self.size

    def restore(self, state: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
        """Put the bodies back to where they were."""
        turn, shift, size = state
        self.turn, self.shift = turn.copy(), shift.copy()
        self._enter(size)

    def swap(self) -> None:
        """Two bodies change places."""
        if len(self.bodies) > 1:
            one, other = self.random.choice(len(self.bodies), 2, replace=False)
            self.shift[[one, other]] = self.shift[[other, one]]
            self._move_in()

    def forget(self) -> None:
        """All weigh the same again."""
        self.weights = np.ones((len(self.turn),) * 2, np.float32)

    @property
    def memory(self) -> int:
        """Bytes that the bodies' tables take; they grow with the third power as voxels get finer."""
        return self._voxels.below.nbytes

    @property
    def edges(self) -> np.ndarray:
        """`(3,)` of the box, metres; those that are given are as given."""
        return self.shape.lengths(self.size * self.voxel)

    @property
    def poses(self) -> tuple[np.ndarray, np.ndarray]:
        """Rotations `(N, 3, 3)` and translations `(N, 3)` of the bodies' centres in the box about the origin."""
        turns = [self._turns[k] for k in self.turn[: len(self.bodies)]]
        corners = (self.shift[: len(turns)] - self.size / 2) * self.voxel
        return np.array([turn.rotation for turn in turns]), corners + np.array([turn.centre for turn in turns])

    # -- moves -------------------------------------------------------------------------------------------------------

    def _move(self, i: int) -> None:
        """Move a body to where it overlaps least, by weight, of what is found; it stays if that is no less."""
        voxels, placed = self._voxels, voxel_runs.Placed(self.turn, self.shift)
        weights = self.weights[i] * self._lengths[i]
        present = voxel_runs.overlap(voxels, placed, i, self.turn[i], self.shift[i], weights, np.float32(np.inf))
        if present == 0:
            return
        turns, spectra, outside = self._correlated(i)
        if not len(turns):
            return  # it lies across, and goes in no other way
        others = np.where(np.arange(len(self.turn)) == i, 0, self.weights[i])
        voxel_runs.add_up(self._blocks, voxels, placed, others, self.cell)
        counts = fft.irfftn(fft.rfftn(self._blocks, self._padded)[None] * spectra, self._padded, axes=(1, 2, 3))
        counts[outside] = np.inf
        best = np.argpartition(counts, min(TUNING.places, counts.size) - 1, axis=None)[: TUNING.places]
        which, *corner = np.unravel_index(best[np.isfinite(counts.flat[best])], counts.shape)
        tried = turns[which]
        shifts = np.minimum(self.cell * np.column_stack(corner), self.size - voxels.sizes[tried])
        self.turn[i], self.shift[i], _ = voxel_runs.best_place(
            voxels, placed, i, weights, self.size, tried, shifts, TUNING.refined, self.cell, present
        )

    def _correlated(self, i: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of a body: the turns that fit the box, `(T,)`, the conjugate spectra of their blocks `(T, ...)`, and where on
        the coarse lattice they would stick out `(T, ...)` bool."""
        key = kind(self.bodies[i])
        if key not in self._spectra:
            turns = np.array(self._fitting(i, self.size), np.int64)
            spectra = [np.conj(fft.rfftn(self._turns[k].coarse, self._padded)).astype(np.complex64) for k in turns]
            outside = np.ones((len(turns), *self._padded), bool)
            for k, one in zip(turns, outside, strict=True):
                last = -(-(self.size - self._voxels.sizes[k]) // self.cell)
                one[tuple(slice(0, end + 1) for end in last)] = False
            self._spectra[key] = turns, np.array(spectra), outside
        return self._spectra[key]

    def _shared(self) -> np.ndarray:
        return voxel_runs.shared_by_pairs(self._voxels, voxel_runs.Placed(self.turn, self.shift))

    # -- the box -----------------------------------------------------------------------------------------------------

    def _enter(self, size: np.ndarray) -> None:
        """Take a box of so many voxels, or of more where a body does not go in; what would stick out is moved in."""
        self.size = np.maximum(size, self._sizes[self.turn[: len(self.bodies)]].max(0))
        if self.shape.zones:
            zones = Turned(np.eye(3), self._zone_voxels(), np.zeros(3))
            self._voxels = laid_out([*self._turns, in_runs(zones, self.cell)])
        elif self._voxels is None:
            self._voxels = laid_out(self._turns)
        self._move_in()
        self._blocks = np.zeros(-(-self.size // self.cell), np.float32)
        self._padded = tuple(fft.next_fast_len(int(n), real=True) for n in self._blocks.shape)
        self._spectra: dict[tuple, tuple[np.ndarray, np.ndarray, np.ndarray]] = {}

    def _zone_voxels(self) -> np.ndarray:
        """The box's voxels that zones take."""
        known = self._zones
        if known is None or known.shape[:2] != tuple(self.size[:2]) or known.shape[2] < self.size[2]:
            known = np.zeros(self.size, bool)
            middles = self.voxel * (np.stack(np.indices(tuple(self.size)), -1) + 0.5)
            middles -= self.voxel * self.size * (0.5, 0.5, 0)
            for zone in self.shape.zones:
                known |= distance_to(zone, middles) < TUNING.zones_wider * self.voxel
            self._zones = known
        return known[:, :, : self.size[2]]

    def _move_in(self) -> None:
        self._left: np.ndarray | None = None  # voxels that pairs share after a sweep, until they are moved otherwise
        self.shift = np.clip(self.shift, 0, self.size - self._voxels.sizes[self.turn])

    def _sticking_out(self, size: np.ndarray) -> np.ndarray:
        """Bodies that are larger than a box as they are turned."""
        return np.flatnonzero((self._sizes[self.turn[: len(self.bodies)]] > size).any(1))

    def _fitting(self, i: int, size: np.ndarray) -> list[int]:
        """The right-angled turns of a body that go into a box."""
        return [k for k in self._choices[i] if (self._sizes[k] <= size).all()]

    def _across(self, body: Body, rotation: np.ndarray) -> VoxelBody:
        """A body turned as no right-angled turn has it."""
        return self._taken(filled(body, rotation, self.voxel))

    def _taken(self, turned: Turned) -> VoxelBody:
        """What a turned body takes."""
        return in_runs(without_overhangs(turned) if self.separable else turned, self.cell)

    def _add(self, turns: Sequence[VoxelBody]) -> list[int]:
        """Keep turned bodies, those of equal voxels once; their numbers."""
        numbers: list[int] = []
        for turn in turns:
            same = (k for k in numbers if np.array_equal(self._turns[k].runs, turn.runs))
            if next(same, None) is None:
                self._turns.append(turn)
                numbers.append(len(self._turns) - 1)
        return numbers
