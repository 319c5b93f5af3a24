"""Energy, forces and stiffness of contact against sums sample by sample, and against what the bodies' motion does."""

import numpy as np
import pytest
import torch
import trimesh

from rasp_core import poses
from rasp_core.geometry import containers
from rasp_core.geometry.containers import Container
from rasp_core.geometry.meshes import make_body
from rasp_core.kernels import surface_contact
from rasp_core.kernels.gauss_newton import system
from rasp_core.packing.contact_solver import _in_blocks

MARGIN = 1e-3
WEIGHT = np.linspace(1, 3, 12)
_ball = trimesh.creation.icosphere(subdivisions=3, radius=0.17)
ROOMS = {
    "box": containers.box((0.3, 0.25, 0.2)),
    "mesh": Container(make_body("ball", _ball.vertices, _ball.faces)),
}


@pytest.fixture(params=list(ROOMS))
def case(crowd, request):
    scene, turns, translation = crowd
    rotation = poses.angles_to_rotation(turns)
    return scene, ROOMS[request.param], rotation, translation, _in_blocks(scene.bodies, 2.0)


def solved(case, rotation=None, translation=None, weighed=True):
    """Energy, pull `(6 N,)`, stiffness `(6 N, 6 N)` and shares `(N,)` by the compiled loop."""
    scene, room, turn, place, samples = case
    turn = turn if rotation is None else rotation
    place = place if translation is None else translation
    bodies = len(scene.bodies)
    pairs = bodies * (bodies - 1) // 2
    diagonal, coupling = np.empty((bodies, 6, 6)), np.empty((pairs, 6, 6))
    which, pull, share = np.empty((pairs, 2), np.int64), np.empty((bodies, 6)), np.empty(bodies)
    half, radius = scene.half.numpy(), np.array([body.radius for body in scene.bodies])
    weight = WEIGHT if weighed else np.ones(bodies)
    arrays = room.arrays(torch.float64), scene.stack.arrays, samples, half, radius, weight, turn.numpy(), place.numpy()
    energy, count = system(*arrays, MARGIN, (diagonal, coupling, which, pull, share))
    stiffness = np.zeros((bodies, 6, bodies, 6))
    for body in range(bodies):
        stiffness[body, :, body] = np.tril(diagonal[body]) + np.tril(diagonal[body], -1).T
    for (one, two), block in zip(which[:count], coupling[:count], strict=True):
        stiffness[one, :, two], stiffness[two, :, one] = block, block.T
    return energy, pull.ravel(), stiffness.reshape(6 * bodies, 6 * bodies), share


def test_sample_by_sample_it_is_the_same(case):
    scene, room, rotation, translation, (points, area, first, _, _, first_block) = case
    bodies = len(scene.bodies)
    own = torch.repeat_interleave(torch.arange(bodies), torch.tensor(np.diff(first[first_block])))
    points, area = torch.tensor(points).double(), torch.tensor(area)
    arm = (rotation[own] @ points[:, :, None])[:, :, 0]
    world = arm + translation[own]
    share, pull, stiffness = np.zeros(bodies), np.zeros(6 * bodies), np.zeros((6 * bodies, 6 * bodies))

    def add(depth, slope, other):
        for row in (depth > 0).nonzero()[:, 0].tolist():
            force = np.zeros((bodies, 6))
            n = slope[row].numpy()
            force[own[row]] = [*n, *np.cross(arm[row].numpy(), n)]
            if other is not None:
                force[other] = [*-n, *-np.cross((world[row] - translation[other]).numpy(), n)]
            met = [own[row].item()] if other is None else [own[row].item(), other]
            weight = area[row].item() * WEIGHT[met].mean()
            share[met] += weight * depth[row].item() ** 2 / len(met)
            pull[:] += weight * depth[row].item() * force.ravel()
            stiffness[:] += weight * np.outer(force, force)

    distance, normal = room.signed_distance(world)
    add(distance + MARGIN, normal, None)
    for other in range(bodies):
        index = torch.full((len(own),), other)
        value, slope = scene.stack.sample(index, (world - translation[other]) @ rotation[other])
        add(torch.where(own == other, -1.0, 2 * MARGIN - value), -slope @ rotation[other].T, other)
    found = solved(case)
    assert found[0] == pytest.approx(share.sum())
    assert found[3] == pytest.approx(share)
    assert found[1] == pytest.approx(pull, abs=1e-9 * np.abs(pull).max())
    assert found[2] == pytest.approx(stiffness, abs=1e-9 * np.abs(stiffness).max())


def test_the_pull_is_half_the_energys_slope(case):
    _, _, rotation, translation, _ = case
    pull = solved(case)[1]
    step = 1e-7
    for body, axis in ((0, 0), (3, 1), (7, 2)):
        shift = torch.zeros_like(translation)
        shift[body, axis] = step
        slope = solved(case, translation=translation + shift)[0] - solved(case, translation=translation - shift)[0]
        assert pull[6 * body + axis] == pytest.approx(slope / (4 * step), rel=1e-3, abs=1e-3 * np.abs(pull).max())
        turns = []
        for sign in (1, -1):
            angle = torch.zeros(1, 3, dtype=torch.float64)
            angle[0, axis] = sign * step
            turned = rotation.clone()
            turned[body] = poses.angles_to_rotation(angle)[0] @ rotation[body]
            turns.append(solved(case, rotation=turned)[0])
        slope = (turns[0] - turns[1]) / (4 * step)
        assert pull[6 * body + 3 + axis] == pytest.approx(slope, rel=1e-3, abs=1e-3 * np.abs(pull).max())


def test_the_energy_is_that_of_the_contact_term(case):
    scene, room, rotation, translation, _ = case
    near = surface_contact.neighbours(
        scene.stack, scene.samples, scene.half, rotation, translation, room, reach=0.01 + 2 * MARGIN
    )
    margin = torch.full((len(scene.bodies),), MARGIN, dtype=torch.float64)
    energy = surface_contact.contact(scene.stack, scene.samples, near, room, rotation, translation, margin)
    assert solved(case, weighed=False)[0] == pytest.approx(energy.item(), rel=1e-5)
