"""What gravity does to a packing: MuJoCo lets the objects fall and come to rest, and the certificate judges anew.

Objects collide as sets of convex pieces (`convex_pieces`), with the mass and inertia of their solids. The container is
closed on all sides; the walls of a mesh are slabs behind its faces.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
import trimesh

from ..exact.certificate import Certificate, certify
from ..geometry.containers import Container
from ..geometry.loading import UNITS
from ..geometry.meshes import Body
from ..packing.layout import Layout
from ..packing.separation import Separation
from ..poses import Poses, degrees_between, file_to_world
from ..problem import Settings
from ..util.errors import InputError
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


def settle(
    bodies: Sequence[Body], matrices: np.ndarray, container: Container, seconds: float = 3.0, until_rest: bool = True
) -> Settled:
    """Let bodies placed by `matrices` `(N, 4, 4)` fall along -z until they rest, or for so many simulated seconds.

    until_rest : stop as soon as all rest; else all the seconds are simulated.

    Lengths are those of a container one metre long, so that a packing falls alike whatever its unit. MuJoCo's contacts
    give way a little; what overlaps by that is pressed out by surface contact, if that will do.
    Raises InputError for no bodies or seconds that are not positive.
    """
    import mujoco

    if not bodies:
        raise InputError("there is nothing to settle; give at least one object")
    if not seconds > 0:
        raise InputError(f"the simulated seconds must be positive, got {seconds}")
    unit = float(np.ptp(container.bounds, axis=0).max())
    model = _model(bodies, matrices, container, unit)
    data = mujoco.MjData(model)
    quiet = 0
    for step in range(1, max(1, round(seconds / SIMULATION.step_seconds)) + 1):
        mujoco.mj_step(model, data)
        if step % SIMULATION.steps_between_checks == 0:
            slow = np.abs(data.qvel.reshape(-1, 6)[:, :3]).max() < SIMULATION.resting_speed
            quiet = quiet + 1 if slow else 0
            if until_rest and quiet >= SIMULATION.quiet_checks:
                break
    mujoco.mj_forward(model, data)
    ids = [model.body(f"{i}").id for i in range(len(bodies))]
    poses = Poses(
        torch.from_numpy(data.xmat[ids].reshape(-1, 3, 3).copy()), torch.from_numpy(data.xpos[ids].copy() * unit)
    )
    placed = _placed(bodies, poses)
    certificate = certify(bodies, placed, container)
    soft_faults = len(certificate.lines())
    if soft_faults:
        separation = Separation(bodies, container, Settings(), torch.device("cpu"), spent=lambda: False)
        separated = separation.settle(Layout(list(range(len(bodies))), poses), seed=0)
        if separated is not None:
            placed = _placed(bodies, separated.poses)
            certificate = certify(bodies, placed, container)
    centres = [_centres(bodies, m) for m in (matrices, placed)]
    turned = degrees_between(*(torch.from_numpy(m[:, :3, :3]) for m in (matrices, placed))).numpy()
    moved = np.linalg.norm(centres[1] - centres[0], axis=1)
    return Settled(
        placed,
        moved,
        turned,
        quiet >= SIMULATION.quiet_checks,
        step * SIMULATION.step_seconds,
        soft_faults,
        certificate,
    )


def _placed(bodies: Sequence[Body], poses: Poses) -> np.ndarray:
    return file_to_world(bodies, poses.rotation, poses.translation)


def _centres(bodies: Sequence[Body], matrices: np.ndarray) -> np.ndarray:
    """`(N, 3)`, where the centres of the bodies' boxes lie."""
    return np.array([m[:3, :3] @ body.centre + m[:3, 3] for body, m in zip(bodies, matrices, strict=True)])


def _model(bodies: Sequence[Body], matrices: np.ndarray, container: Container, unit: float):
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
    centres = _centres(bodies, matrices)
    for i, (body, matrix) in enumerate(zip(bodies, matrices, strict=True)):
        reuse = body.digest in known
        pieces = known.setdefault(body.digest, [] if reuse else convex_pieces(body))
        added = spec.worldbody.add_body(name=f"{i}", pos=centres[i] / unit)
        mujoco.mju_mat2Quat(added.quat, np.ascontiguousarray(matrix[:3, :3]).ravel())
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
