"""What gravity does to a packing: the objects fall and come to rest, and the certificate judges anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from ..exact.certificate import Certificate, certify
from ..geometry.containers import Container
from ..geometry.loading import UNITS
from ..geometry.meshes import Body
from ..packing.layout import Layout
from ..packing.separation import Separation
from ..poses import Poses, degrees_between, file_to_world, from_matrices
from ..problem import Settings
from ..util.errors import InputError
from .falling import Fall


@dataclass(frozen=True)
class Settled:
    """A packing after its fall.

    matrices `(N, 4, 4)`: file coordinates to the world. moved `(N,)` metres, of the bodies' centres; turned_deg `(N,)`.
    at_rest : whether all had come to rest; simulated : seconds that passed for the objects. soft_faults : what the
    certificate found before surface contact took out what MuJoCo's contacts, which give way, had let through.
    """

    matrices: np.ndarray
    moved: np.ndarray
    turned_deg: np.ndarray
    at_rest: bool
    simulated: float
    soft_faults: int
    certificate: Certificate

    def lines(self, unit: str = "m") -> list[str]:
        """What happened, in words: how far objects moved, and what the certificate says; lengths in a unit of
        `loading.UNITS`."""
        faults, moved = len(self.certificate.lines()), self.moved / UNITS[unit]
        rest = " to rest" if self.at_rest else ""
        return [
            f"settled{rest} in {self.simulated:.1f} s: moved by {moved.mean():.2g} {unit} in the mean, "
            f"{moved.max():.2g} {unit} at most, turned by {self.turned_deg.mean():.1f} degrees; "
            f"{f'{faults} faults' if faults else 'certified'}",
            *(f"settled, {line}" for line in self.certificate.lines(unit)[:20]),
        ]

    def to_dict(self) -> dict:
        """As plain numbers, for `result.json`."""
        return {
            "moved_mean": float(self.moved.mean()),
            "moved_max": float(self.moved.max()),
            "turned_deg_mean": float(self.turned_deg.mean()),
            "turned_deg_max": float(self.turned_deg.max()),
            "at_rest": self.at_rest,
            "simulated_seconds": self.simulated,
            "soft_faults": self.soft_faults,
            "certificate": self.certificate.to_dict(),
            "poses": self.matrices.tolist(),
        }


def settle(bodies: Sequence[Body], matrices: np.ndarray, container: Container, seconds: float = 3.0) -> Settled:
    """Let bodies placed by `matrices` `(N, 4, 4)` fall along -z until they rest, or for so many simulated seconds.

    Raises InputError for no bodies or seconds that are not positive.
    """
    if not bodies:
        raise InputError("there is nothing to settle; give at least one object")
    if not seconds > 0:
        raise InputError(f"the simulated seconds must be positive, got {seconds}")
    start = from_matrices(bodies, matrices)
    fallen = Fall(bodies, container).run(start, seconds)
    poses, soft_faults, certificate = pressed_out(bodies, fallen.poses, container)
    moved = (poses.translation - start.translation).norm(dim=1).numpy()
    turned = degrees_between(start.rotation, poses.rotation).numpy()
    placed = file_to_world(bodies, poses.rotation, poses.translation)
    return Settled(placed, moved, turned, fallen.at_rest, fallen.simulated, soft_faults, certificate)


def pressed_out(bodies: Sequence[Body], poses: Poses, container: Container) -> tuple[Poses, int, Certificate]:
    """Poses without what MuJoCo's contacts, which give way a little, had let through, if surface contact can take it
    out; how many faults that were, and what the certificate says now."""
    certificate = certify(bodies, file_to_world(bodies, poses.rotation, poses.translation), container)
    faults = len(certificate.lines())
    if not faults:
        return poses, 0, certificate
    separation = Separation(bodies, container, Settings(), torch.device("cpu"), spent=lambda: False)
    separated = separation.settle(Layout(list(range(len(bodies))), poses), seed=0)
    if separated is None:
        return poses, faults, certificate
    poses = Poses(separated.poses.rotation.double(), separated.poses.translation.double())
    return poses, faults, certify(bodies, file_to_world(bodies, poses.rotation, poses.translation), container)
