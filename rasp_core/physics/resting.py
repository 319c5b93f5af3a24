"""Packings that stand by themselves: what a search found settles under gravity, and what is over drops onto it.

Objects fall and come to rest; what then finds room above them is dropped from there, and all fall
again, while that gains. In the end MuJoCo lets all stand for two seconds, and nothing may move by more than a little.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from ..geometry.containers import Container, FreeBox
from ..geometry.loading import UNITS
from ..geometry.meshes import Body
from ..packing.dropping import drop
from ..packing.pool import Worth
from ..packing.result import Packing, finish_anew
from ..poses import Poses, from_matrices, join
from ..util.errors import InputError
from .falling import Fall
from .gravity import pressed_out

SECONDS = 2.0  # that a packing is to stand
MOST_MOVED = 0.003  # of the container's longest edge, by which what stands may move: a millimetre in 0.33 m
REST_SECONDS = 20.0  # that a packing has to come to rest
TRIES = 6  # of letting it come to rest once more
DROPS = 4  # times that what is over is dropped on top


@dataclass(frozen=True)
class Resting:
    """How a packing stands.

    moved : metres, of the point of any object that moved farthest in the simulated seconds. most : that it may.
    """

    moved: float
    most: float
    seconds: float

    @property
    def holds(self) -> bool:
        """Whether it stands."""
        return self.moved <= self.most

    def summary(self, unit: str = "m") -> str:
        """What was found, in words; lengths in a unit of `loading.UNITS`."""
        verdict = "stands by itself" if self.holds else "does not come to rest"
        return f"{verdict}: in {self.seconds:g} s no point moved by more than {self.moved / UNITS[unit]:.2g} {unit}"

    def to_dict(self) -> dict:
        """As plain numbers, for `result.json`."""
        return {"stands": self.holds, "moved_max": self.moved, "allowed": self.most, "seconds": self.seconds}


def check_may_rest(
    pool: Sequence[Body],
    container: Container | FreeBox,
    clearance: float | None = None,
    wall_clearance: float | None = None,
    separable: bool = False,
) -> None:
    """Raise InputError where what is asked of a packing and gravity exclude each other."""
    if isinstance(container, FreeBox):
        raise InputError("gravity needs a container that is given, and a box is to be found; name its edges")
    if any(body.wishes.fixed for body in pool):
        raise InputError("what is fixed does not fall; leave out fixed, or gravity")
    check_may_turn(pool, "gravity")
    if clearance or wall_clearance or any(body.wishes.clearance for body in pool):
        raise InputError("what comes to rest touches; leave out the clearance, or gravity")
    if separable:
        raise InputError("separable and gravity each move what the other has placed; ask for one of them")


def check_may_turn(pool: Sequence[Body], asked: str) -> None:
    """Raise InputError naming a body of which only some turns are wished; asked : what would turn it."""
    for body in pool:
        if body.wishes.turns is not None:
            raise InputError(
                f"{body.name}: turns {body.wishes.turns.word} are not kept by what falls; leave out {asked}"
            )


def made_resting(
    packed: Packing,
    pool: Sequence[Body],
    container: Container,
    most: int | None = None,
    device: str | torch.device = "cpu",
) -> tuple[Packing, Resting]:
    """The packing at rest, with what of the pool was dropped onto it, certified anew, and how it stands.

    pool : that `packed.chosen` counts, all of which pass `check_may_rest`. most : objects, at most.
    """
    worth = Worth(pool)

    def rested(chosen: list[int], start: Poses) -> tuple[Packing, Resting]:
        poses, resting = _rested([pool[i] for i in chosen], start, container)
        return finish_anew(packed, pool, chosen, poses, container, device), resting

    best, resting = rested(list(packed.chosen), packed.poses)
    for _ in range(DROPS):
        over = [i for i in range(len(pool)) if i not in set(best.chosen)]
        dropped = drop(pool, over, best.chosen, best.matrices, container)[0]
        if most is not None:
            dropped = dropped[: most - len(best.chosen)]
        if not dropped:
            break
        more, found = rested(
            [*best.chosen, *(i for i, _ in dropped)],
            join(best.poses, from_matrices([pool[i] for i, _ in dropped], np.array([m for _, m in dropped]))),
        )
        if not (more.certificate.holds and found.holds and worth.more(more.chosen, best.chosen)):
            break
        best, resting = more, found
    return best, resting


def _rested(bodies: Sequence[Body], start: Poses, container: Container) -> tuple[Poses, Resting]:
    """Where bodies come to rest and how they stand there; of several tries the one that stands best."""
    most = MOST_MOVED * float(np.ptp(container.bounds, axis=0).max())
    fall, found = Fall(bodies, container), []
    fallen = fall.run(start, REST_SECONDS)
    for _ in range(TRIES):
        poses = pressed_out(bodies, fallen.poses, container)[0]
        fallen = fall.run(poses, SECONDS, until_rest=False)
        found.append((poses, Resting(_farthest(bodies, poses, fallen.poses), most, SECONDS)))
        if found[-1][1].holds:
            break
    return min(found, key=lambda one: one[1].moved)


def _farthest(bodies: Sequence[Body], before: Poses, after: Poses) -> float:
    """Metres by which a point of a body moved at most."""
    turned, moved = (after.rotation - before.rotation).numpy(), (after.translation - before.translation).numpy()
    pairs = zip(bodies, turned, moved, strict=True)
    return max(float(np.linalg.norm(body.solid_vertices @ r.T + t, axis=1).max()) for body, r, t in pairs)
