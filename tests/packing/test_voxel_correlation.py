"""Voxels cover what they stand for; correlations against loops."""

import numpy as np
import pytest
import torch
import trimesh
from oracles import winding_number
from scipy import ndimage

from data_fetch import cad_like, kitchen_like, polycubes, torus
from rasp_core import poses
from rasp_core.geometry.containers import Container, box
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.sdf import bake
from rasp_core.geometry.wishes import quarter_turns
from rasp_core.packing import voxel_correlation
from rasp_core.packing.voxel_correlation import Room, Turned

ROOM = box((0.1, 0.08, 0.06))


def blocky(seed: int, shape=(3, 2, 4)) -> Turned:
    cells = np.random.default_rng(seed).random(shape) < 0.6
    cells[0, 0, 0] = True
    return Turned(np.eye(3), cells, np.zeros(3))


def naive(room: Room, turned: Turned, field: np.ndarray) -> np.ndarray:
    """Sum of a field over the object's voxels, shift by shift."""
    size = turned.voxels.shape
    found = np.zeros([n - s + 1 for n, s in zip(room.shape, size, strict=True)])
    for shift in np.ndindex(found.shape):
        where = tuple(slice(s, s + n) for s, n in zip(shift, size, strict=True))
        found[shift] = field[where][turned.voxels].sum()
    return found


def test_quarter_turns_are_the_cubes_group():
    turns = quarter_turns()
    assert len({tuple(turn.ravel()) for turn in turns}) == 24
    assert np.allclose(np.linalg.det(turns), 1)
    assert np.array_equal(turns[0], np.eye(3))


@pytest.mark.parametrize("seed", range(3))
def test_every_point_of_a_body_lies_in_a_covering_voxel(seed):
    body = (kitchen_like(3) + cad_like(3))[2 * seed]
    rotation = poses.quaternion_to_rotation(poses.random_quaternions(1, torch.Generator().manual_seed(seed)))
    turned = Turned.covering(body, rotation[0].double().numpy(), 0.004)
    mesh = trimesh.Trimesh(body.solid_vertices, body.solid_faces, process=False)
    points = trimesh.sample.sample_surface(mesh, 5000, seed=0)[0] @ turned.rotation.T + turned.centre
    cells = np.floor(points / 0.004 + 1e-9).astype(int)
    away = np.abs(points / 0.004 - np.round(points / 0.004)).min(1) > 0.01  # those on a border may count to either side
    assert turned.voxels[tuple(cells[away].T)].all()
    assert turned.voxels.sum() * 0.004**3 > body.volume


@pytest.mark.parametrize("seed", range(3))
def test_filling_voxels_are_those_whose_middle_the_body_holds(seed):
    body = kitchen_like(6)[2 * seed]
    rotation = poses.quaternion_to_rotation(poses.random_quaternions(1, torch.Generator().manual_seed(seed)))
    turned = Turned.filling(bake(body.solid_vertices, body.solid_faces), body.half_extents, rotation[0].numpy(), 0.002)
    assert turned.voxels.sum() * 0.002**3 == pytest.approx(body.volume, rel=0.03)
    placed = body.solid_vertices @ rotation[0].double().numpy().T
    middles = (np.stack(np.indices(turned.voxels.shape), -1).reshape(-1, 3) + 0.5) * 0.002 - turned.centre
    inside = winding_number(middles[::17], placed, body.solid_faces) > 0.5
    assert (inside != turned.voxels.ravel()[::17]).mean() < 0.01


@pytest.mark.parametrize("quarter", [0, 5, 17])
def test_polycubes_are_covered_by_their_own_cubes_and_no_others(quarter):
    """Their faces lie on the voxels' borders, inner corners too."""
    cubes = polycubes(cell=0.05, gap=0.0)
    for body in cubes:
        turned = Turned.covering(body, quarter_turns()[quarter], 0.05)
        assert turned.voxels.sum() * 0.05**3 == pytest.approx(body.volume)
    assert any(not Turned.covering(body, np.eye(3), 0.05).voxels.all() for body in cubes), "some are no boxes"


def test_quarter_turned_voxels_are_those_of_the_turned_body():
    body = kitchen_like(6)[5]
    straight = Turned.covering(body, np.eye(3), 0.004)
    for quarter in quarter_turns():
        turned, anew = straight.turned(quarter, 0.004), Turned.covering(body, quarter, 0.004)
        assert turned.voxels.shape == anew.voxels.shape
        assert (turned.voxels != anew.voxels).mean() < 0.01, "open3d may put what lies on a border to either side"
        assert turned.centre == pytest.approx(anew.centre)
        assert np.array_equal(turned.rotation, quarter)


def test_equal_cubes_are_found_and_other_objects_get_a_fine_voxel():
    cubes = polycubes()
    edge = voxel_correlation.choose_voxel(cubes, box((0.32, 0.32, 0.3)))
    sizes = np.concatenate([2 * body.half_extents for body in cubes])
    assert sizes.min() <= edge <= 1.02 * sizes.min(), "the cubes of a piece lie a little apart"
    assert np.abs(sizes / edge - np.round(sizes / edge)).max() < 0.03
    assert voxel_correlation.choose_voxel(kitchen_like(5), box((0.32, 0.32, 0.3))) == pytest.approx(0.005)
    ball = trimesh.creation.icosphere(radius=0.03)
    balls = [make_body("ball", ball.vertices, ball.faces)]
    assert voxel_correlation.choose_voxel(balls, box((0.32, 0.32, 0.3))) == pytest.approx(0.005), (
        "its box is a cube, it is not"
    )


def test_a_long_container_is_looked_at_no_more_coarsely_across():
    mean_edge = (0.2 * 0.2 * 2.0) ** (1 / 3)
    assert voxel_correlation.choose_voxel(kitchen_like(5), box((0.2, 0.2, 2.0))) == pytest.approx(1.5 * mean_edge / 64)


def test_cubes_are_found_that_lie_a_thirtieth_apart():
    edge = voxel_correlation.choose_voxel(polycubes(cell=0.0353), box((0.18, 0.18, 0.18)))
    assert 0.0343 <= edge <= 0.0353


@pytest.mark.parametrize("seed", range(4))
def test_placement_is_the_naive_searchs(seed):
    room, turned = Room(ROOM, 0.01), blocky(seed)
    assert tuple(room.shape) == (10, 8, 6)
    room.clear(np.random.default_rng(seed).random(room.shape) < 0.1)
    shared = naive(room, turned, room.taken)
    _, shift, volume = room.least_shared([turned])
    assert volume == pytest.approx(shared.min() * 1e-6, abs=1e-12)
    assert shared[tuple(shift)] == shared.min()
    room.clear()
    room.place(turned, np.array([0, 0, 0]))
    _, shift = room.snuggest([turned])
    distance = ndimage.distance_transform_edt(np.pad(~room.taken, 1))[1:-1, 1:-1, 1:-1]
    cost = naive(room, turned, distance) / turned.voxels.sum()
    cost[naive(room, turned, room.taken) > 0] = np.inf
    assert cost[tuple(shift)] <= cost.min() + voxel_correlation.TUNING.floor_bias_voxels


@pytest.mark.parametrize("seed", range(4))
def test_the_deepest_place_is_the_naive_searchs(seed):
    room, turned = Room(ROOM, 0.01), blocky(seed)
    room.clear(np.random.default_rng(seed).random(room.shape) < 0.05)
    free = np.argwhere(naive(room, turned, room.taken) == 0)
    _, shift = room.deepest([turned])
    assert tuple(shift) == tuple(min(free.tolist(), key=lambda s: s[::-1]))


@pytest.mark.parametrize("seed", range(4))
def test_the_flattest_place_is_the_naive_searchs(seed):
    """Dropped voxel by voxel on what is there, at every place; the sum of the raised heights is the least."""
    room, turned = Room(ROOM, 0.01), blocky(seed)
    for k, at in enumerate([(0, 0, 0), (4, 3, 0), (5, 5, 0), (0, 4, 0)]):
        room.place(blocky(k), np.array(at))
    top = room.shape[2]
    heights = np.where(room.taken.any(2), top - room.taken[:, :, ::-1].argmax(2), 0)
    costs = {}
    for i, j in np.ndindex(*(room.shape[:2] - turned.voxels.shape[:2] + 1)):
        under = heights[i : i + turned.voxels.shape[0], j : j + turned.voxels.shape[1]]
        landed = next(k for k in range(top) if all(k + z >= under[x, y] for x, y, z in np.argwhere(turned.voxels)))
        if landed + turned.voxels.shape[2] <= top:
            raised = sum(
                landed + column.nonzero()[0].max() + 1 - under[x, y]
                for (x, y), column in ((xy, turned.voxels[xy]) for xy in np.ndindex(under.shape))
                if column.any()
            )
            costs[i, j, landed] = raised + voxel_correlation.TUNING.corner_bias_voxels * (i + j)
    _, shift = room.flattest([turned])
    assert costs[tuple(shift)] == min(costs.values())


def test_nothing_fits_a_full_room_or_one_that_is_too_small():
    room = Room(ROOM, 0.01)
    assert room.snuggest([blocky(0, (11, 1, 1))]) is None
    assert room.least_shared([blocky(0, (1, 9, 1))]) is None
    room.clear(np.ones(room.shape, bool))
    for rule in (room.snuggest, room.deepest, room.flattest):
        assert rule([blocky(0)]) is None


def test_a_meshs_walls_are_taken():
    ring = Container(torus(0.12, 0.05))
    room = Room(ring, 0.005)
    free = (~room.taken).sum() * 0.005**3
    assert 0.5 * ring.volume < free < ring.volume
    assert room.taken[tuple(room.shape // 2)], "the hole is not the ring's"
    assert (~Room(ring, 0.005, margin=0).taken).sum() * 0.005**3 == pytest.approx(ring.volume, rel=0.02)
