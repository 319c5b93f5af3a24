"""The compiled counts against the same written plainly with numpy."""

import numpy as np
import pytest
import trimesh

from rasp_core.art.greedy_cover import _arrays
from rasp_core.art.run_length import Profiles
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.sdf import GridStack
from rasp_core.geometry.surface_samples import surface_samples
from rasp_core.kernels import greedy_cover as kernels

SIZE = 96
NONE = (np.zeros((0, 0, 0)),) * 3


def ball(radius=0.1):
    mesh = trimesh.creation.icosphere(3, radius)
    return make_body("ball", mesh.vertices, mesh.faces)


def scene_of(bodies, cameras, worth, veil=NONE):
    profiles = Profiles.of(bodies, cameras, turns=2, seed=0)
    sums = np.concatenate([np.zeros((*worth.shape[:2], 1)), worth.cumsum(2)], 2)
    arrays = profiles.runs, profiles.rotation, profiles.reach, profiles.radius
    return _arrays(cameras), arrays, sums, veil


def disk(camera, place, radius, size=SIZE):
    """Pixels whose centre lies in a ball's shadow, near enough."""
    row, column = camera.pixels(np.array([place]), 4096)
    zoom = 1.0
    if camera.projection == "perspective":
        zoom = 2 / (2 + float(camera.axes[2] @ place) / camera.width)
    at = (np.arange(size) + 0.5) / size * 4096
    return np.hypot(at[:, None] - row, at - column) < radius * zoom / camera.width * 4096


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_gain_adds_up_what_the_silhouettes_cover(projection):
    cameras = [Camera(0, 0, 1.0, projection=projection), Camera(60, 30, 1.0, projection=projection)]
    worth = np.random.default_rng(0).normal(size=(2, SIZE, SIZE)) + 1
    place = np.array([0.12, -0.2, 0.07])
    found = kernels.gain(scene_of([ball()], cameras, worth), 1, place)
    wanted = sum(worth[k][disk(camera, place, 0.1)].sum() for k, camera in enumerate(cameras))
    assert found == pytest.approx(wanted, rel=0.05)


def test_a_veil_counts_where_it_lies_before_what_is_seen():
    cameras = [Camera(0, 0, 1.0), Camera(90, 0, 1.0)]
    place, nothing = np.array([0.1, 0.0, 0.0]), np.zeros((2, SIZE, SIZE))
    depth = np.full((2, SIZE, SIZE), 0.5)
    hidden, shared = np.ones((2, SIZE, SIZE)), np.zeros((2, 2, 2))
    area = np.pi * 0.1**2 * SIZE**2
    before = kernels.gain(scene_of([ball()], cameras, nothing, (hidden, depth, shared)), 0, place)
    assert before == pytest.approx(2 * area, rel=0.05)
    depth[1] = -0.5  # the second view sees something nearer
    before = kernels.gain(scene_of([ball()], cameras, nothing, (hidden, depth, shared)), 0, place)
    assert before == pytest.approx(area, rel=0.05)
    depth[1], shared[:] = 0.5, 0.01
    before = kernels.gain(scene_of([ball()], cameras, nothing, (hidden, depth, shared)), 0, place)
    assert before == pytest.approx(2 * area - 0.01 * SIZE**2, rel=0.05)


def test_gains_are_minus_infinity_outside():
    cameras = [Camera(0, 0, 1.0), Camera(90, 0, 1.0)]
    scene = scene_of([ball()], cameras, np.ones((2, SIZE, SIZE)))
    bounds, found = np.array([[-0.5] * 3, [0.5] * 3]), np.empty(2)
    kernels.gains(scene, bounds, np.zeros(2, int), np.array([[0.0, 0, 0], [0.45, 0, 0]]), found)
    assert found[0] == kernels.gain(scene, 0, np.zeros(3))
    assert found[1] == -np.inf


def solids(bodies):
    samples = surface_samples(bodies)
    first = np.append(samples.start.numpy(), len(samples.points))
    return GridStack.of_bodies(bodies).arrays, (samples.points.numpy(), first), np.array([b.radius for b in bodies])


@pytest.mark.parametrize(("apart", "free"), [(0.19, False), (0.199, False), (0.204, True), (0.3, True)])
def test_balls_are_free_of_each_other_where_their_middles_are_two_radii_apart(apart, free):
    placed = np.zeros(1, np.int64), np.eye(3)[None], np.zeros((1, 3))
    at = apart * np.array([0.6, 0.0, 0.8])
    assert kernels.free(solids([ball()]), placed, 0, np.eye(3), at, 1e-3) == free


def test_a_small_body_within_a_large_one_is_not_free():
    placed = np.zeros(1, np.int64), np.eye(3)[None], np.zeros((1, 3))
    both = solids([ball(), ball(0.02)])
    assert not kernels.free(both, placed, 1, np.eye(3), np.zeros(3), 1e-3)
    assert not kernels.free(both, (np.ones(1, np.int64), *placed[1:]), 0, np.eye(3), np.zeros(3), 1e-3)


def test_climbing_finds_the_middle_of_a_disk_and_stays_free():
    cameras, bounds = [Camera(0, 0, 1.0), Camera(90, 0, 1.0)], np.array([[-0.5] * 3, [0.5] * 3])
    centre = np.array([0.1, -0.1, 0.05])
    worth = np.stack([np.where(disk(camera, centre, 0.1), 1.0, -1.0) for camera in cameras])
    scene, nothing = scene_of([ball()], cameras, worth), (np.zeros(0, np.int64), np.zeros((0, 3, 3)), np.zeros((0, 3)))
    place = centre + np.array([0.05, 0.04, -0.03])
    _, value = kernels.climb(scene, bounds, solids([ball()]), nothing, 1e-3, 2, 0, place, 0.08, 0.002)
    assert np.linalg.norm(place - centre) < 0.01
    assert value == pytest.approx(kernels.gain(scene, 0, place), rel=0.02)
    there = np.zeros(1, np.int64), np.eye(3)[None], centre[None]
    place = centre + np.array([0.22, 0.0, 0.0])
    kernels.climb(scene, bounds, solids([ball()]), there, 1e-3, 2, 0, place, 0.08, 0.002)
    assert np.linalg.norm(place - centre) > 0.2
