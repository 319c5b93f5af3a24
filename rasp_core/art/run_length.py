"""Silhouettes of single bodies in many turns, as runs along the rows of small images: for counting pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from .. import poses
from ..geometry.cameras import Camera
from ..geometry.meshes import Body
from ..geometry.silhouette_edges import Outlines, Views
from ..silhouettes import mask

ROWS = 64  # across the diameter of a body's sphere
RUNS = 4  # in a row, at most; a body with more holes beside each other loses the last


@dataclass(frozen=True)
class Profiles:
    """L = bodies x turns silhouettes before K views; those of body b begin at `b * turns`.

    runs `(L, K, ROWS, RUNS, 2)` int8: first column and the one after the last, of an image whose edge is the diameter
    of the body's sphere about its centre; 0, 0 if there is none. rotation `(L, 3, 3)`. half_extents `(L, 3)` of the
    turned body's box, metres. radius `(L,)` metres.
    """

    runs: np.ndarray
    rotation: np.ndarray
    half_extents: np.ndarray
    radius: np.ndarray
    turns: int

    @classmethod
    def of(cls, bodies: Sequence[Body], cameras: Sequence[Camera], turns: int, seed: int) -> Profiles:
        """Every body in `turns` random turns, seen along each view's middle ray."""
        generator = torch.Generator().manual_seed(seed)
        runs, rotations, half_extents = [], [], []
        for body in bodies:
            rotation = poses.quaternion_to_rotation(poses.random_quaternions(turns, generator, torch.float64)).numpy()
            runs.append(_runs(_masks(body, rotation, cameras)))
            rotations.append(rotation)
            corners = body.solid_vertices @ rotation.transpose(0, 2, 1)
            half_extents.append(np.abs(corners).max(1))
        radius = np.repeat([body.radius for body in bodies], turns)
        return cls(
            runs=np.concatenate(runs),
            rotation=np.concatenate(rotations),
            half_extents=np.concatenate(half_extents),
            radius=radius,
            turns=turns,
        )


def _masks(body: Body, rotation: np.ndarray, cameras: Sequence[Camera]) -> np.ndarray:
    """`(turns, K, ROWS, ROWS)` bool: the views turned against the body, which stays."""
    views = Views([Camera(0, 0, 2 * body.radius)] * (len(rotation) * len(cameras)))
    axes = np.stack([camera.axes for camera in cameras])
    turned = torch.from_numpy(np.einsum("kij,tjl->tkil", axes, rotation).reshape(-1, 3, 3))
    views.axes, views.eye = turned.float(), torch.cat([-turned[:, 2], torch.zeros(len(turned), 1)], 1).float()
    still = torch.eye(3)[None], torch.zeros(1, 3)
    images = mask(Outlines([body]), *still, views, ROWS).numpy()
    return images.reshape(len(rotation), len(cameras), ROWS, ROWS)


def _runs(masks: np.ndarray) -> np.ndarray:
    """Masks `(..., ROWS, ROWS)` as runs `(..., ROWS, RUNS, 2)`."""
    rows = masks.reshape(-1, masks.shape[-1])
    steps = np.diff(np.pad(rows.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    found = np.zeros((len(rows), RUNS, 2), np.int8)
    for end, sign in enumerate((1, -1)):
        row, column = np.nonzero(steps == sign)
        number = np.arange(len(row)) - np.searchsorted(row, row)
        kept = number < RUNS
        found[row[kept], number[kept], end] = column[kept]
    return found.reshape(*masks.shape[:-1], RUNS, 2)
