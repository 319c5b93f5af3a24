"""Packings at rest: what floats comes down, what is over goes on top, and a simulation of its own finds it standing."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
import torch
import trimesh

import rasp_core as rasp
from data_fetch import kitchen_like
from rasp_core.geometry.containers import FreeBox, box
from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.geometry.wishes import Wishes, turns_of
from rasp_core.packing.result import finish
from rasp_core.physics.resting import Resting, check_may_rest, made_resting
from rasp_core.poses import Poses
from rasp_core.problem import Settings
from rasp_core.util.errors import InputError


def cubes(count, edge=0.1):
    mesh = trimesh.creation.box([edge] * 3)
    return unique_names([make_body("cube", mesh.vertices, mesh.faces)] * count)


def packed_at(pool, room, *places):
    poses = Poses(torch.eye(3).repeat(len(places), 1, 1), torch.tensor(places))
    return finish(pool, list(range(len(places))), poses, room, Settings(resolution=16))


def test_what_floats_comes_down_and_what_is_over_goes_on_top():
    pool, room = cubes(4), box((0.21, 0.11, 0.31))
    rested, resting = made_resting(packed_at(pool, room, (-0.05, 0.0, 0.1), (0.05, 0.0, -0.05)), pool, room)
    assert rested.certificate.holds
    assert resting.holds
    assert sorted(rested.chosen) == [0, 1, 2, 3]
    heights = sorted(rested.poses.translation[:, 2].tolist())
    assert heights[:2] == pytest.approx([-0.105] * 2, abs=1e-3)
    assert heights[2:] == pytest.approx([-0.005] * 2, abs=2e-3)
    assert rested.density == pytest.approx(4e-3 / room.volume)


def test_no_more_are_dropped_than_are_asked_for():
    pool, room = cubes(4), box((0.21, 0.11, 0.31))
    rested, _ = made_resting(packed_at(pool, room, (0.0, 0.0, 0.0)), pool, room, most=2)
    assert len(rested.chosen) == 2


def test_a_packing_at_rest_stands_in_a_simulation_of_its_own():
    """Blocks alone, so that MuJoCo's own boxes can judge: they fall from where they rest, and do not move."""
    random, pool = np.random.default_rng(0), []
    for k, edges in enumerate(random.uniform(0.03, 0.09, (14, 3))):
        mesh = trimesh.creation.box(edges)
        pool.append(make_body(f"block_{k}", mesh.vertices, mesh.faces))
    room = rasp.box(0.2, 0.2, 0.2)
    found = rasp.pack(pool, room, method="spectral", gravity=True)
    assert found.certificate.holds
    assert found.resting.holds
    assert "stands by itself: in 2 s no point moved" in found.resting.summary("mm")
    spec = mujoco.MjSpec()
    spec.option.noslip_iterations = 10
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for side in (-1, 1):
        for axis in range(3):
            size, place = np.full(3, 1.0), np.zeros(3)
            size[axis], place[axis] = 0.1, side * 0.6
            spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=size, pos=place)
    for body, matrix in zip(found.bodies, found.matrices, strict=True):
        added = spec.worldbody.add_body(pos=(matrix[:3, :3] @ body.centre + matrix[:3, 3]) / 0.2)
        mujoco.mju_mat2Quat(added.quat, np.ascontiguousarray(matrix[:3, :3]).ravel())
        added.add_freejoint()
        added.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=body.half_extents / 0.2)
    model = spec.compile()
    data = mujoco.MjData(model)
    before = data.qpos.copy().reshape(-1, 7)[:, :3]
    for _ in range(1000):
        mujoco.mj_step(model, data)
    moved = np.linalg.norm(data.qpos.reshape(-1, 7)[:, :3] - before, axis=1)
    assert moved.max() * 0.2 < 1e-3, "metres"


def test_gravity_is_recorded_and_told():
    found = rasp.pack(cubes(2, 0.05), rasp.box(0.12, 0.12, 0.12), method="spectral", gravity=True)
    assert found.record()["gravity"]["stands"] is True
    boxes = rasp.pack_boxes(cubes(9, 0.05), rasp.box(0.11, 0.11, 0.11), "spectral", gravity=True)
    assert boxes.resting
    assert any("box 1: stands by itself" in line for line in boxes.lines())
    assert not Resting(0.1, 0.01, 2.0).holds
    assert "does not come to rest" in Resting(0.1, 0.01, 2.0).summary()


def test_what_gravity_excludes_is_refused():
    pool, room = kitchen_like(2), box((0.3, 0.3, 0.3))
    (cube,) = cubes(1)
    wished = [replace(cube, wishes=Wishes(turns=turns_of("z", cube.manifold)))]
    fixed = [replace(cube, wishes=Wishes(fixed=True))]
    for bodies, where, options, told in (
        (pool, FreeBox((None, None, None)), {}, "gravity needs a container that is given"),
        (fixed, room, {}, "what is fixed does not fall"),
        (wished, room, {}, "turns z are not kept by what falls; leave out gravity"),
        (pool, room, {"clearance": 0.001}, "what comes to rest touches"),
        (pool, room, {"separable": True}, "ask for one of them"),
    ):
        with pytest.raises(InputError, match=told):
            check_may_rest(bodies, where, **options)
