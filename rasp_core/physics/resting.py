"""Packings that stand by themselves: what a search found settles under gravity, and what is over drops onto it.

Objects fall and come to rest (`gravity.settle`); what then finds room above them is dropped from there, and all fall
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
from ..poses import from_matrices
from ..util.errors import InputError
from .gravity import settle

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
    turned = [body for body in pool if body.wishes.turns is not None]
    if turned:
        raise InputError(
            f"{turned[0].name}: turns {turned[0].wishes.turns.word} are not kept by what falls; leave out gravity"
        )
    if clearance or wall_clearance or any(body.wishes.clearance for body in pool):
        raise InputError("what comes to rest touches; leave out the clearance, or gravity")
    if separable:
        raise InputError("separable and gravity each move what the other has placed; ask for one of them")


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
    worth, chosen = Worth(pool), list(packed.chosen)
    matrices, resting = _rested([pool[i] for i in chosen], packed.matrices, container)
    best = finish_anew(packed, pool, chosen, from_matrices(packed.bodies, matrices), container, device)
    for _ in range(DROPS):
        over = [i for i in range(len(pool)) if i not in set(best.chosen)]
        dropped = drop(pool, over, best.chosen, best.matrices, container)[0]
        if most is not None:
            dropped = dropped[: most - len(best.chosen)]
        if not dropped:
            break
        chosen = [*best.chosen, *(i for i, _ in dropped)]
        bodies, placed = [pool[i] for i in chosen], np.concatenate([best.matrices, [m for _, m in dropped]])
        matrices, found = _rested(bodies, placed, container)
        more = finish_anew(packed, pool, chosen, from_matrices(bodies, matrices), container, device)
        if not (more.certificate.holds and found.holds and worth.more(more.chosen, best.chosen)):
            break
        best, resting = more, found
    return best, resting


def _rested(bodies: Sequence[Body], matrices: np.ndarray, container: Container) -> tuple[np.ndarray, Resting]:
    """Where bodies come to rest, `(N, 4, 4)`, and how they stand there; of several tries the one that stands best."""
    most = MOST_MOVED * float(np.ptp(container.bounds, axis=0).max())
    matrices, found = settle(bodies, matrices, container, REST_SECONDS).matrices, []
    for _ in range(TRIES):
        after = settle(bodies, matrices, container, SECONDS, until_rest=False)
        found.append((matrices, Resting(_farthest(bodies, matrices, after.matrices), most, SECONDS)))
        if found[-1][1].holds:
            break
        matrices = after.matrices
    return min(found, key=lambda one: one[1].moved)


def _farthest(bodies: Sequence[Body], before: np.ndarray, after: np.ndarray) -> float:
    """Metres by which a point of a body moved at most."""
    pairs = zip(bodies, before, after, strict=True)
    return max(float(np.linalg.norm(body.placed(a) - body.placed(b), axis=1).max()) for body, a, b in pairs)
