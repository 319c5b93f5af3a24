"""Whether solids that hang by threads stay as they are: MuJoCo lets them swing a little, and they come to rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import manifold3d
import numpy as np
import trimesh

from ..util.errors import InputError
from .falling import SIMULATION

KICK = 0.005  # metres a second by which each begins to move, in a heap that is one metre wide
SPIN = 0.05  # radians a second by which each begins to turn
DAMPING = 1.0  # a second: how fast they slow down
STRETCH_SECONDS = 0.004  # in which a thread gives way; MuJoCo wants at least two steps
SHORTEST = 1e-4  # metres, of a thread: where what touches is joined
MOST_MOVED = 0.01  # of the heap's width, by a solid that stays
MOST_TURNED_DEG = 2.0


class Thread(Protocol):
    """From `low` `(3,)` on solid number `body` up to `high` `(3,)`, on solid `above`, or on what stays if None."""

    body: int
    above: int | None
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True)
class Swinging:
    """Where solids are after the simulated seconds: moved, the furthest, of the heap's width; turned_deg, the most."""

    moved: float
    turned_deg: float
    seconds: float

    @property
    def stays(self) -> bool:
        """Whether all are about where they were."""
        return self.moved <= MOST_MOVED and self.turned_deg <= MOST_TURNED_DEG

    def line(self) -> str:
        """What was found, in words."""
        if self.stays:
            return f"hangs still after {self.seconds:g} s"
        return f"does not hang still: an object turned by {self.turned_deg:.0f} degrees in {self.seconds:g} s"

    def to_dict(self) -> dict:
        """As plain numbers, for `result.json`."""
        return {
            "stays": self.stays,
            "moved_of_width": self.moved,
            "turned_deg": self.turned_deg,
            "seconds": self.seconds,
        }


def swing(
    solids: Sequence[manifold3d.Manifold], threads: Sequence[Thread], width: float, seconds: float = 5.0
) -> Swinging:
    """Let placed solids hang by threads, which do not stretch, each kicked a little, for some simulated seconds.

    width : of the heap, in the solids' unit; it is simulated a metre wide. Solids do not collide. Raises InputError
    unless the seconds are positive.
    """
    import mujoco

    if not seconds > 0:
        raise InputError(f"the simulated seconds must be positive, got {seconds}")
    model = _model(solids, threads, 1 / width)
    data, random = mujoco.MjData(model), np.random.default_rng(0)
    start = data.qpos.reshape(-1, 7).copy()
    kicks = random.standard_normal((len(solids), 3))
    kicks /= np.linalg.norm(kicks, axis=1)[:, None]
    data.qvel[:] = np.concatenate([KICK * kicks, SPIN * kicks[:, ::-1]], 1).ravel()
    for _ in range(max(1, round(seconds / SIMULATION.step_seconds))):
        mujoco.mj_step(model, data)
    poses = data.qpos.reshape(-1, 7)
    moved = np.linalg.norm(poses[:, :3] - start[:, :3], axis=1)
    turned = np.degrees(2 * np.arccos(np.clip(np.abs(poses[:, 3]), 0, 1)))
    return Swinging(float(moved.max()), float(turned.max()), seconds)


def _model(solids: Sequence[manifold3d.Manifold], threads: Sequence[Thread], scale: float):
    import mujoco

    spec = mujoco.MjSpec()
    spec.option.timestep = SIMULATION.step_seconds
    spec.option.gravity = [0, 0, -9.81]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    bodies, middles = [], []
    for number, solid in enumerate(solids):
        mesh = solid.to_mesh64()
        points = scale * np.array(mesh.vert_properties)[:, :3]
        shape = trimesh.Trimesh(points, np.array(mesh.tri_verts, np.int64), process=False)
        body = spec.worldbody.add_body(name=f"solid {number}", pos=shape.center_mass)
        body.add_freejoint()
        inertia = shape.moment_inertia * SIMULATION.density
        body.explicitinertial = True
        body.mass, body.ipos = shape.volume * SIMULATION.density, [0, 0, 0]
        body.fullinertia = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
        bodies.append(body)
        middles.append(shape.center_mass)
    for number, thread in enumerate(threads):
        low, high, above = scale * thread.low, scale * thread.high, thread.above
        bodies[thread.body].add_site(name=f"low {number}", pos=low - middles[thread.body])
        if above is None:
            spec.worldbody.add_site(name=f"high {number}", pos=high)
        else:
            bodies[above].add_site(name=f"high {number}", pos=high - middles[above])
        tendon = spec.add_tendon(name=f"thread {number}")
        tendon.limited, tendon.range = True, [0, max(float(np.linalg.norm(high - low)), SHORTEST)]
        tendon.solref_limit = [STRETCH_SECONDS, 1.0]
        tendon.wrap_site(f"low {number}")
        tendon.wrap_site(f"high {number}")
    model = spec.compile()
    masses = np.concatenate([np.repeat(model.body_mass[1:, None], 3, 1), model.body_inertia[1:]], 1)
    model.dof_damping[:] = DAMPING * masses.ravel()
    return model
