"""How well two pieces fit each other under many poses; what was looked at once is kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from .crease_matching import SETTINGS, Piece, touching, within

STEPS_A_SPACING = 50  # poses that round to the same are looked at once
STEPS_A_TURN = 1000  # of the numbers of a rotation
KEPT = 50_000  # poses that are kept, some 2 kB each; then all are forgotten

# by marks: whether one of two faces lies on another piece, and ends there although no crease of another is near
LEDGE = np.array([0, 0, 1, 0, 1, 0, 0, 0], np.float32)


@dataclass(frozen=True)
class Joints:
    """A piece, of E crease points, beside another one, of F, under B poses.

    own `(B, E)`, other `(B, F)` float32, 0 to 1: how near each crease point of either lies to one of the other that
    matches it, times its weight. own_marks, other_marks, uint8: see `kernels.creases.marks`. rest `(B,)`: rough points
    that touch, less the penalty for what lies within the other, in crease points.
    """

    own: np.ndarray
    other: np.ndarray
    own_marks: np.ndarray
    other_marks: np.ndarray
    rest: np.ndarray

    def taken(self, rows: np.ndarray) -> Joints:
        """Those of some poses."""
        return Joints(*(getattr(self, field.name)[rows] for field in fields(self)))

    def joined(self, more: Joints) -> Joints:
        """These, then more."""
        pairs = ((getattr(self, field.name), getattr(more, field.name)) for field in fields(self))
        return Joints(*(np.concatenate(pair) for pair in pairs))

    @property
    def swapped(self) -> Joints:
        """The same as the other piece sees it."""
        return Joints(self.other, self.own, self.other_marks, self.own_marks, self.rest)

    @property
    def worth(self) -> np.ndarray:
        """`(B,)`: crease points that coincide, and the rest."""
        return (self.own.sum(1) + self.other.sum(1)) / 2 + self.rest


class Fits:
    """The joints of all pairs of pieces."""

    def __init__(self, pieces: Sequence[Piece]):
        self.pieces = pieces
        self._known: dict[tuple, tuple] = {}

    def between(self, i: int, j: int, rotation: np.ndarray, translation: np.ndarray) -> Joints:
        """Joints of piece j under poses `(B, 3, 3)`, `(B, 3)` as seen from piece i."""
        if i > j:
            back = rotation.swapaxes(1, 2)
            return self.between(j, i, back, -np.einsum("bij,bj->bi", back, translation)).swapped
        one, other = len(self.pieces[j].creases.points), len(self.pieces[i].creases.points)
        found = Joints(
            *(np.zeros((len(rotation), count), np.float32) for count in (one, other)),
            *(np.zeros((len(rotation), count), np.uint8) for count in (one, other)),
            np.zeros(len(rotation)),
        )
        reach = self.pieces[i].body.radius + self.pieces[j].body.radius
        near = np.flatnonzero((translation**2).sum(1) < reach**2)
        steps = np.rint(translation[near] * (STEPS_A_SPACING / self.pieces[i].spacing)).astype(np.int32)
        turns = np.rint(rotation[near].reshape(-1, 9) * STEPS_A_TURN).astype(np.int32)
        keys = [(i, j, row.tobytes()) for row in np.concatenate([steps, turns], axis=1)]
        new = [n for n, key in enumerate(keys) if key not in self._known]
        if new:
            if len(self._known) > KEPT:
                self._known = {key: self._known[key] for key in keys if key in self._known}
            looked = self._look(i, j, np.ascontiguousarray(rotation[near[new]]), translation[near[new]])
            self._known.update(zip([keys[n] for n in new], zip(*looked, strict=True), strict=True))
        for n, key in zip(near, keys, strict=True):
            for field, row in zip(fields(found), self._known[key], strict=True):
                getattr(found, field.name)[n] = row
        return found

    def _look(self, i: int, j: int, rotation: np.ndarray, translation: np.ndarray) -> tuple:
        from ..kernels import creases

        still, piece, last = self.pieces[i], self.pieces[j], SETTINGS.rounds[-1]
        back = np.ascontiguousarray(rotation.swapaxes(1, 2))
        found, marked = [], []
        for moving, rest, pose in (
            (piece, still, (rotation, translation)),
            (still, piece, (back, -np.einsum("bij,bj->bi", back, translation))),
        ):
            target = rest.target
            each = creases.matches(
                target.creases,
                target.lookup,
                moving.creases,
                *pose,
                reach=last.reach * piece.spacing,
                cosine=last.cosine,
            )
            found.append(each.astype(np.float32) * moving.weights)
            marked.append(
                creases.marks(
                    target.creases,
                    target.lookup,
                    target.solids["grids"],
                    rest.body.half_extents,
                    moving.creases,
                    moving.strips,
                    *pose,
                    reach=SETTINGS.ledge_spacings * piece.spacing,
                    near=SETTINGS.contact_spacings * piece.spacing,
                    cosine=SETTINGS.contact_cosine,
                )
            )
        rest = SETTINGS.contact_weight * touching(piece, still.target, rotation, translation)
        rest -= SETTINGS.penalty * within(piece, still.target, rotation, translation)
        return *found, *marked, rest
