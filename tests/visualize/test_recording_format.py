"""The format, read by `read_recording`, against the true poses and surfaces."""

import json

import numpy as np
import pytest
import trimesh
from read_recording import read

from data_fetch import kitchen_like
from rasp_core.geometry.containers import box
from rasp_core.geometry.meshes import make_body
from rasp_core.poses import random_quaternions
from rasp_core.visualize import recording_format
from rasp_core.visualize.recording import Run, container_views


def turned(quaternion: np.ndarray, points: np.ndarray) -> np.ndarray:
    """By q p q*, without a matrix."""
    w, u = quaternion[0], quaternion[1:]
    return points + 2 * np.cross(u, np.cross(u, points) + w * points)


def moving(bodies, frames=7, seed=0, step=0.1):
    """A run of small random steps, in which the second body is away for a while."""
    import torch
    from scipy.spatial.transform import Rotation

    random, count = np.random.default_rng(seed), len(bodies)
    generator = torch.Generator().manual_seed(seed)
    first = Rotation.from_quat(random_quaternions(count, generator).numpy()[:, [1, 2, 3, 0]]).as_matrix()
    small = (
        Rotation.from_rotvec(random.normal(0, 6 * step, (frames * count, 3))).as_matrix().reshape(frames, count, 3, 3)
    )
    rotation = small @ first
    translation = np.cumsum(random.normal(0, step, (frames, count, 3)), 0)
    present = np.ones((frames, count), bool)
    present[2:4, 1] = False
    losses = random.random((frames, 5))
    losses[-1] = np.nan
    shares = random.random(frames)
    return Run({"lambda": 0.5}, np.arange(frames) * 3, 20, rotation, translation, present, losses, shares)


@pytest.fixture(scope="module")
def encoded():
    bodies = kitchen_like(6)
    bodies.append(make_body("can#2", bodies[0].vertices, bodies[0].faces))
    run, room = moving(bodies), box((0.3, 0.2, 0.4))
    found = recording_format.encode(bodies, room, container_views(room), {"lambda": [0.5]}, [run, moving(bodies, 4, 1)])
    return bodies, run, json.loads(json.dumps(found))


def test_poses_come_back_within_the_error_that_is_stated(encoded):
    bodies, run, held = encoded
    off, angle, _ = recording_format.step_errors(held)
    assert off < 1e-4
    assert angle < 1e-3
    _, (poses, other), _ = read(held)
    assert poses.shape == (7, 7, 7)
    assert other.shape == (4, 7, 7)
    assert (np.isnan(poses).all(-1) == ~run.present).all()
    assert np.nanmax(np.abs(poses[..., :3] - run.translation)) <= off * (1 + 1e-9)
    for frame, n in zip(*np.nonzero(run.present), strict=True):
        quaternion = poses[frame, n, 3:] / np.linalg.norm(poses[frame, n, 3:])
        points = bodies[n].solid_vertices
        apart = np.linalg.norm(turned(quaternion, points) - points @ run.rotation[frame, n].T, axis=1)
        assert apart.max() <= angle * bodies[n].radius


def test_losses_and_what_varies_come_back(encoded):
    _, run, held = encoded
    _, _, ((losses, overlap), _) = read(held)
    assert np.allclose(losses, run.losses, rtol=1e-6, equal_nan=True)
    assert np.allclose(overlap, run.overlap, rtol=1e-6)
    assert held["runs"][0] == {"values": [0.5], "iterations": [0, 3, 6, 9, 12, 15, 18], "total": 20}
    assert held["varied"] == {"lambda": [0.5]}


def test_surfaces_stray_by_no_more_than_is_stated(encoded):
    bodies, _, held = encoded
    meshes, _, _ = read(held)
    assert [name for name, _, _ in held["objects"]] == [body.name for body in bodies]
    assert len(meshes) == 7, "copies share one, and the container has one"
    assert held["objects"][0][1] == held["objects"][6][1]
    simpler = 0
    for body, (_, number, _) in zip(bodies, held["objects"], strict=True):
        vertices, faces = meshes[number]
        stray = held["meshes"][number][3]
        assert len(faces) <= recording_format.MOST_OF_ONE
        simpler += len(faces) < len(body.solid_faces)
        corners = vertices[faces]
        for point in body.solid_vertices[::7]:
            every = np.repeat(point[None], len(corners), 0)
            nearest = trimesh.triangles.closest_point(corners, every)
            assert np.linalg.norm(nearest - point, axis=1).min() <= stray + 1e-7
        assert stray < 0.05 * body.radius
    assert simpler == 3
    number, centre = held["container"]
    corners = meshes[number][0] + centre
    assert np.abs(np.abs(corners) - [0.15, 0.1, 0.2]).max() < 1e-4


def test_views_are_those_of_the_container(encoded):
    _, _, held = encoded
    right, up, forward, centre, width = held["views"][1]
    assert np.allclose([right, up, forward], [[0, 1, 0], [0, 0, 1], [-1, 0, 0]])
    assert (centre, width) == ([0, 0, 0], 0.8)


def test_quaternions_keep_their_sign_along_the_frames():
    run = moving(kitchen_like(2), frames=60)
    found = recording_format.quaternions(run.rotation)
    assert ((found[1:] * found[:-1]).sum(-1) >= 0).all()
    assert np.allclose(turned(found[30, 1], np.eye(3)), run.rotation[30, 1].T)


def test_a_hundred_frames_of_forty_objects_are_small():
    bodies, room = kitchen_like(40), box((0.38, 0.38, 0.38))
    run = moving(bodies, frames=100, step=0.002)
    held = recording_format.encode(bodies, room, container_views(room), {}, [run])
    assert len(json.dumps(held)) < 100_000
