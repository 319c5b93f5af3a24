"""What every packing method returns, and how it ends: drawn, and certified anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from ..density import mesh_density
from ..exact.certificate import TOLERANCE, Certificate, certify
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..objective import LOSS_NAMES
from ..optimizer import Arrangement
from ..poses import Poses
from ..problem import Problem, Settings
from ..silhouettes import render
from ..util.errors import InputError


@dataclass(frozen=True)
class Packing:
    """A packing of some of a pool's objects.

    chosen : indices into the pool, in the order of `bodies`.
    history : `(I, 5)` losses of every iteration of every round, columns `objective.LOSS_NAMES`.
    rounds : what each round left, for the record.
    """

    arrangement: Arrangement
    chosen: list[int]
    certificate: Certificate
    history: np.ndarray
    rounds: list[dict]

    @property
    def bodies(self) -> Sequence[Body]:
        """The objects that were packed."""
        return self.arrangement.problem.bodies

    @property
    def container(self) -> Container:
        """What they lie in."""
        return self.arrangement.problem.container

    @property
    def matrices(self) -> np.ndarray:
        """`(N, 4, 4)` float64: from each file's coordinates to the world."""
        return self.arrangement.matrices

    @property
    def poses(self) -> Poses:
        """Of the bodies' centres, metres, world."""
        return self.arrangement.poses

    @property
    def images(self) -> np.ndarray:
        """`(K, H, H)` float32 silhouettes in [0, 1], row 0 on top, one for each view."""
        return self.arrangement.images

    @property
    def density(self) -> float:
        """Eq. 6: the objects' volume over the container's."""
        return mesh_density(self.bodies, self.container)


def finish(
    bodies: Sequence[Body],
    chosen: list[int],
    poses: Poses,
    container: Container,
    settings: Settings,
    device: str | torch.device = "cpu",
    history: Sequence[np.ndarray] = (),
    rounds: Sequence[dict] = (),
    interrupted: bool = False,
) -> Packing:
    """The packing of the objects `chosen` from `bodies` at `poses` in their order, drawn and certified.

    settings : for the record; the resolution is that of the images. history : `(I, 5)` losses of each round.

    Raises InputError if nothing was chosen.
    """
    if not chosen:
        raise InputError("not one of the objects could be placed in the container; enlarge it or leave some out")
    problem = Problem([bodies[i] for i in chosen], container)
    scene = problem.scene(device)
    rotation = poses.rotation.to(scene.device, scene.dtype)
    translation = poses.translation.to(scene.device, scene.dtype)
    images = render(scene.outlines, rotation, translation, scene.views, settings.resolution).cpu().numpy()
    losses = np.concatenate([np.zeros((0, len(LOSS_NAMES)), np.float32), *history])
    arrangement = Arrangement(
        problem=problem,
        settings=settings,
        rotation=poses.rotation.double().cpu(),
        translation=poses.translation.double().cpu(),
        images=images,
        targets=scene.container_silhouettes(settings.resolution).cpu().numpy(),
        cameras=scene.cameras,
        history=losses,
        interrupted=interrupted,
    )
    certificate = certify(problem.bodies, arrangement.matrices, container, TOLERANCE)
    return Packing(arrangement, list(chosen), certificate, losses, list(rounds))
