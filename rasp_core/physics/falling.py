"""Bodies that fall in a container, by MuJoCo.

They collide as sets of convex pieces (`convex_pieces`), with the mass and inertia of their solids. The container is
closed on all sides; the walls of a mesh are slabs behind its faces. Lengths are those of a container one metre long, so
that bodies fall alike whatever their unit.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
import trimesh

from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..poses import Poses
from .convex_pieces import convex_pieces, prisms, simplified


@dataclass(frozen=True)
class Simulation:
    """How MuJoCo simulates a fall; lengths are those of a container one metre long."""

    step_seconds: float = 0.002
    friction: float = 0.5
    density: float = 1000.0
    contact_seconds: float = 0.004  # in which a contact gives way; MuJoCo wants at least two steps
    margin: float = 0.00005  # at which a contact begins to bear, so that what gives way is no overlap
    resting_speed: float = 0.002  # metres a second, below which a body counts as resting
    steps_between_checks: int = 50  # of the speeds
    quiet_checks: int = 5  # one after the other, after which all rest
    friction_over_normal: float = 10.0  # how much stiffer a contact is along itself, so that what rests does not creep
    friction_sweeps: int = 10  # that take out what creeps none the less
    wall_thickness: float = 0.05
    most_wall_faces: int = 1500  # of a mesh container


SIMULATION = Simulation()


@dataclass(frozen=True)
class Fallen:
    """Where bodies are after a fall: poses, float64; at_rest : whether none moved any more; simulated : seconds."""

    poses: Poses
    at_rest: bool
    simulated: float


class Fall:
    """The simulation of bodies in a container, made once, in which they can fall from any poses."""

    def __init__(self, bodies: Sequence[Body], container: Container) -> None:
        import mujoco

        self.unit = float(np.ptp(container.bounds, axis=0).max())
        self.model = _model(bodies, container, self.unit)
        self.data = mujoco.MjData(self.model)
        self.ids = [self.model.body(f"{i}").id for i in range(len(bodies))]

    def run(self, start: Poses, seconds: float, until_rest: bool = True) -> Fallen:
        """Let the bodies fall along -z from where `start` has them, at rest, for so many simulated seconds.

        until_rest : stop as soon as all rest; else all the seconds are simulated.
        """
        import mujoco

        mujoco.mj_resetData(self.model, self.data)
        for place, turned, moved in zip(self.data.qpos.reshape(-1, 7), start.rotation, start.translation, strict=True):
            place[:3] = moved.numpy() / self.unit
            mujoco.mju_mat2Quat(place[3:], turned.numpy().ravel())
        quiet = 0
        for step in range(1, max(1, round(seconds / SIMULATION.step_seconds)) + 1):
            mujoco.mj_step(self.model, self.data)
            if step % SIMULATION.steps_between_checks == 0:
                slow = np.abs(self.data.qvel.reshape(-1, 6)[:, :3]).max() < SIMULATION.resting_speed
                quiet = quiet + 1 if slow else 0
                if until_rest and quiet >= SIMULATION.quiet_checks:
                    break
        mujoco.mj_forward(self.model, self.data)
        rotation, translation = self.data.xmat[self.ids].reshape(-1, 3, 3), self.data.xpos[self.ids] * self.unit
        poses = Poses(torch.from_numpy(rotation), torch.from_numpy(translation))
        return Fallen(poses, quiet >= SIMULATION.quiet_checks, step * SIMULATION.step_seconds)


def _model(bodies: Sequence[Body], container: Container, unit: float):
    """MuJoCo's model: one free body for each of ours, named by its index, and the container's walls."""
    import mujoco

    spec = mujoco.MjSpec()
    spec.option.timestep = SIMULATION.step_seconds
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = SIMULATION.friction_over_normal
    spec.option.noslip_iterations = SIMULATION.friction_sweeps

    def add_piece(parent, name: str, vertices: np.ndarray, reuse: bool = False) -> None:
        if not reuse:
            corners = np.asarray(vertices / unit).ravel()
            spec.add_mesh(name=name, uservert=corners, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
        parent.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, **contact)

    contact = {
        "friction": [SIMULATION.friction, 0.005, 0.0001],
        "margin": SIMULATION.margin,
        "solref": [SIMULATION.contact_seconds, 1.0],
        "solimp": [0.95, 0.99, 0.0005, 0.5, 2.0],
    }
    known: dict[str, list[np.ndarray]] = {}
    for i, body in enumerate(bodies):
        reuse = body.digest in known
        pieces = known.setdefault(body.digest, [] if reuse else convex_pieces(body))
        added = spec.worldbody.add_body(name=f"{i}")
        added.add_freejoint()
        solid = trimesh.Trimesh(body.solid_vertices / unit, body.solid_faces, process=False)
        inertia = SIMULATION.density * solid.moment_inertia
        added.explicitinertial = True
        added.mass, added.ipos = SIMULATION.density * solid.volume, solid.center_mass
        added.fullinertia = [*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]]
        for k, piece in enumerate(pieces):
            add_piece(added, f"{body.digest}.{k}", piece, reuse)
    if container.size is None:
        for k, slab in enumerate(_slabs(container)):
            add_piece(spec.worldbody, f"wall.{k}", slab)
        return spec.compile()
    half, thick = container.size / unit / 2, SIMULATION.wall_thickness / 2
    for axis, side in itertools.product(range(3), (-1, 1)):
        size, position = half + 2 * thick, np.zeros(3)
        size[axis], position[axis] = thick, side * (half[axis] + thick)
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=size, pos=position, **contact)
    return spec.compile()


def _slabs(container: Container) -> list[np.ndarray]:
    """`(6, 3)` corners of a slab behind each face of a mesh container, where it ends."""
    hull, edge = container.body, float(np.ptp(container.bounds, axis=0).max())
    mesh = simplified(hull.solid_vertices + hull.centre, hull.solid_faces, SIMULATION.most_wall_faces)
    return prisms(mesh, -SIMULATION.wall_thickness * edge)
