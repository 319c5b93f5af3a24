"""The compiled counts against the same written plainly with numpy."""

import numpy as np
import pytest
import trimesh

from rasp_core.art.greedy_cover import view_arrays
from rasp_core.art.run_length import Profiles
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.sdf import GridStack
from rasp_core.geometry.surface_samples import surface_samples
from rasp_core.kernels import greedy_cover as kernels

SIZE = 96
BOUNDS = np.array([[-0.5] * 3, [0.5] * 3])


def ball(radius=0.1):
    mesh = trimesh.creation.icosphere(3, radius)
    return make_body("ball", mesh.vertices, mesh.faces)


def scene_of(bodies, cameras, worth, occlusion=kernels.NO_OCCLUSION):
    profiles = Profiles.of(bodies, cameras, turns=2, seed=0)
    sums = np.concatenate([np.zeros((*worth.shape[:2], 1)), worth.cumsum(2)], 2)
    arrays = kernels.Silhouettes(profiles.runs, profiles.rotation, profiles.half_extents, profiles.radius)
    return kernels.Scene(view_arrays(cameras), arrays, sums, occlusion)


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


def test_an_occluder_counts_where_it_lies_before_what_is_seen():
    cameras = [Camera(0, 0, 1.0), Camera(90, 0, 1.0)]
    place, nothing = np.array([0.1, 0.0, 0.0]), np.zeros((2, SIZE, SIZE))
    depth = np.full((2, SIZE, SIZE), 0.5)
    hidden, shared = np.ones((2, SIZE, SIZE)), np.zeros((2, 2, 2))
    area = np.pi * 0.1**2 * SIZE**2
    before = kernels.gain(scene_of([ball()], cameras, nothing, kernels.Occlusion(hidden, depth, shared)), 0, place)
    assert before == pytest.approx(2 * area, rel=0.05)
    depth[1] = -0.5  # the second view sees something nearer
    before = kernels.gain(scene_of([ball()], cameras, nothing, kernels.Occlusion(hidden, depth, shared)), 0, place)
    assert before == pytest.approx(area, rel=0.05)
    depth[1], shared[:] = 0.5, 0.01
    before = kernels.gain(scene_of([ball()], cameras, nothing, kernels.Occlusion(hidden, depth, shared)), 0, place)
    assert before == pytest.approx(2 * area - 0.01 * SIZE**2, rel=0.05)


def test_gains_are_minus_infinity_outside():
    cameras = [Camera(0, 0, 1.0), Camera(90, 0, 1.0)]
    scene = scene_of([ball()], cameras, np.ones((2, SIZE, SIZE)))
    found = kernels.gains(scene, BOUNDS, np.zeros(2, int), np.array([[0.0, 0, 0], [0.45, 0, 0]]))
    assert found[0] == kernels.gain(scene, 0, np.zeros(3))
    assert found[1] == -np.inf


def obstacles(bodies, placed=(), at=()):
    """Bodies of the pool by number, upright at their places."""
    samples = surface_samples(bodies)
    return kernels.Obstacles(
        bounds=BOUNDS,
        solids=kernels.Solids(
            grids=GridStack.of_bodies(bodies).arrays,
            points=samples.points.numpy(),
            first=np.append(samples.start.numpy(), len(samples.points)),
            radius=np.array([body.radius for body in bodies]),
        ),
        body=np.array(placed, np.int64),
        rotation=np.tile(np.eye(3), (len(placed), 1, 1)),
        translation=np.array(at, float).reshape(-1, 3),
        margin=1e-3,
    )


@pytest.mark.parametrize(("apart", "free"), [(0.19, False), (0.199, False), (0.204, True), (0.3, True)])
def test_balls_are_free_of_each_other_where_their_middles_are_two_radii_apart(apart, free):
    at = apart * np.array([0.6, 0.0, 0.8])
    assert kernels.is_free(obstacles([ball()], [0], [(0, 0, 0)]), 0, np.eye(3), at) == free


def test_a_small_body_within_a_large_one_is_not_free():
    both = [ball(), ball(0.02)]
    assert not kernels.is_free(obstacles(both, [0], [(0, 0, 0)]), 1, np.eye(3), np.zeros(3))
    assert not kernels.is_free(obstacles(both, [1], [(0, 0, 0)]), 0, np.eye(3), np.zeros(3))


def test_climbing_finds_the_middle_of_a_disk_and_stays_free():
    cameras = [Camera(0, 0, 1.0), Camera(90, 0, 1.0)]
    centre = np.array([0.1, -0.1, 0.05])
    worth = np.stack([np.where(disk(camera, centre, 0.1), 1.0, -1.0) for camera in cameras])
    scene, steps = scene_of([ball()], cameras, worth), {"first_step": 0.08, "last_step": 0.002}
    at = centre + np.array([0.05, 0.04, -0.03])
    _, value = kernels.climb(scene, obstacles([ball()]), turns=2, which=0, at=at, **steps)
    assert np.linalg.norm(at - centre) < 0.01
    assert value == pytest.approx(kernels.gain(scene, 0, at), rel=0.02)
    at = centre + np.array([0.22, 0.0, 0.0])
    kernels.climb(scene, obstacles([ball()], [0], [centre]), turns=2, which=0, at=at, **steps)
    assert np.linalg.norm(at - centre) > 0.2
