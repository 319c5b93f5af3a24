"""Whether one solid stands on the floor: its centre of mass over what it stands on, and MuJoCo, which lets it.

What touches a level floor is the solid's convex hull, so that MuJoCo needs no other shape of it; mass, centre of mass
and inertia are the solid's own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import ConvexHull

from ..util.errors import InputError
from .falling import SIMULATION

DROPPED = 1e-3  # of the solid's height: how far above the floor it begins
FLAT = 1e-4  # of the height: how far above the lowest point a corner is taken to touch
MOST_TURNED_DEG = 1.0  # that a solid which stands may have turned
GRAVITY = 9.81
HEIGHT = 1.0  # metres that the simulated solid is high, so that contacts are alike for all


@dataclass(frozen=True)
class Standing:
    """How a solid stands.

    tips_deg : how far it may be tilted, in the direction in which it falls soonest; negative where its centre of mass
    is not over what it stands on. turned_deg, moved : after the simulated seconds; moved in heights."""

    tips_deg: float
    turned_deg: float
    moved: float
    seconds: float

    @property
    def stands(self) -> bool:
        """Whether the centre of mass is over its footing, and MuJoCo's solid has not turned."""
        return self.tips_deg > 0 and self.turned_deg <= MOST_TURNED_DEG

    def line(self) -> str:
        """What was found, in words."""
        if self.stands:
            return f"stands for {self.seconds:g} s, and until tilted by {self.tips_deg:.0f} degrees"
        return f"does not stand: turned by {self.turned_deg:.0f} degrees in {self.seconds:g} s; make its base wider"

    def to_dict(self) -> dict:
        """As plain numbers, for `result.json`."""
        return {
            "stands": self.stands,
            "tips_deg": self.tips_deg,
            "turned_deg": self.turned_deg,
            "moved_heights": self.moved,
            "seconds": self.seconds,
        }


def stand(vertices: np.ndarray, faces: np.ndarray, seconds: float = 5.0) -> Standing:
    """Put a closed solid, vertices `(V, 3)` and faces `(F, 3)`, on a floor as it is, z up, for some simulated seconds.

    The unit of length does not count: it is simulated a metre high. Raises InputError unless the seconds are positive.
    """
    import mujoco

    if not seconds > 0:
        raise InputError(f"the simulated seconds must be positive, got {seconds}")
    low = vertices[:, 2].min()
    height = float(np.ptp(vertices[:, 2]))
    solid = trimesh.Trimesh((vertices - [0, 0, low]) * (HEIGHT / height), faces, process=False)
    hull = solid.convex_hull
    centre = solid.center_mass
    model = _model(hull, solid)
    data = mujoco.MjData(model)
    start = data.qpos.copy()
    for _ in range(max(1, round(seconds / SIMULATION.step_seconds))):
        mujoco.mj_step(model, data)
    turned = np.degrees(2 * np.arccos(np.clip(abs(data.qpos[3]), 0, 1)))
    moved = float(np.linalg.norm(data.qpos[:2] - start[:2])) / HEIGHT
    return Standing(_tips_deg(np.asarray(hull.vertices), centre), float(turned), moved, seconds)


def _tips_deg(points: np.ndarray, centre: np.ndarray) -> float:
    """The tilt about the nearest edge of what touches the floor at which the centre of mass is over that edge."""
    feet = points[points[:, 2] < FLAT * np.ptp(points[:, 2])][:, :2]
    if len(feet) < 3 or np.linalg.matrix_rank(feet - feet[0], tol=1e-9) < 2:
        return -90.0  # a point or an edge
    footing = ConvexHull(feet)
    inside = -(footing.equations[:, :2] @ centre[:2] + footing.equations[:, 2])  # of each edge, metres
    return float(np.degrees(np.arctan2(inside.min(), centre[2])))


def _model(hull: trimesh.Trimesh, solid: trimesh.Trimesh):
    import mujoco

    spec = mujoco.MjSpec()
    spec.option.timestep = SIMULATION.step_seconds
    spec.option.gravity = [0, 0, -GRAVITY]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    friction = [SIMULATION.friction, 0.005, 0.0001]
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], friction=friction)
    body = spec.worldbody.add_body(name="solid", pos=[0, 0, DROPPED * HEIGHT])
    body.add_freejoint()
    inertia = solid.moment_inertia / solid.mass
    body.explicitinertial = True
    body.mass, body.ipos = 1.0, solid.center_mass
    body.fullinertia = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    spec.add_mesh(name="hull", uservert=np.asarray(hull.vertices).ravel(), userface=np.asarray(hull.faces).ravel())
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="hull", friction=friction)
    return spec.compile()
