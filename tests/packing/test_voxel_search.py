"""A search among voxels: what it says is free is free by booleans, and blocks of whole voxels leave no gap."""

from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh
from scipy.spatial.transform import Rotation

from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import FreeBox, box
from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.geometry.wishes import Turns, Wishes
from rasp_core.geometry.zones import box_of, free_without
from rasp_core.packing.voxel_search import VoxelSearch
from rasp_core.poses import file_to_world

VOXEL = 0.01
STRIP = FreeBox((0.08, 0.08, None))


def blocks(*edges):
    meshes = [trimesh.creation.box(np.array(one) * VOXEL) for one in edges]
    return unique_names([make_body("block", mesh.vertices, mesh.faces) for mesh in meshes])


def searched(bodies, edges, sweeps, seed=0):
    """A search from all in the middle, until nothing is shared."""
    search = VoxelSearch(bodies, STRIP, VOXEL, np.random.default_rng(seed))
    search.begin(np.tile(np.eye(3), (len(bodies), 1, 1)), np.zeros((len(bodies), 3)), np.array(edges))
    return search, next((k for k in range(sweeps) if search.sweep() == 0), None)


def holds(search):
    rotation, translation = (torch.from_numpy(values) for values in search.poses)
    matrices = file_to_world(search.bodies, rotation, translation)
    return certify(search.bodies, matrices, box(search.edges)).holds


def test_blocks_of_whole_voxels_fill_a_box():
    bodies = blocks(*[(4, 4, 4)] * 4, *[(8, 4, 2)] * 4)
    search, sweeps = searched(bodies, (0.08, 0.08, 0.08), 300)
    assert sweeps is not None
    assert holds(search)
    assert sum(body.volume for body in bodies) == pytest.approx(np.prod(search.edges))


@pytest.mark.parametrize("separable", [False, True])
@pytest.mark.parametrize("up", [0, -2])
def test_where_all_is_to_come_out_through_the_top_nothing_lies_in_a_tunnel(separable, up):
    hollow = trimesh.creation.box(np.array([4, 8, 4]) * VOXEL)
    hollow.apply_translation((0, 0, up * VOXEL))
    block = trimesh.boolean.difference([trimesh.creation.box([8 * VOXEL] * 3), hollow])
    as_they_are = Wishes(turns=Turns("none", np.eye(3)[None], False))
    bodies = [make_body("hollow", block.vertices, block.faces), *blocks((4, 8, 4))]
    bodies = [replace(body, wishes=as_they_are) for body in bodies]
    search = VoxelSearch(bodies, STRIP, VOXEL, np.random.default_rng(0), separable=separable)
    search.begin(np.tile(np.eye(3), (2, 1, 1)), np.zeros((2, 3)), np.full(3, 8 * VOXEL))
    free = any(search.sweep() == 0 for _ in range(50))
    assert free == (up < 0 or not separable), "a bridge is lifted off what it spans"


def test_a_box_shrinks_by_a_voxel_and_is_restored():
    search, _ = searched(blocks((4, 4, 4)), (0.08, 0.08, 0.08), 5)
    state = search.state()
    assert search.shrink()
    assert search.edges == pytest.approx([0.08, 0.08, 0.07])
    search.swap()
    search.restore(state)
    assert search.edges == pytest.approx([0.08, 0.08, 0.08])
    assert [np.array_equal(a, b) for a, b in zip(search.state(), state, strict=True)] == [True] * 3


def test_a_body_that_would_not_go_in_stops_it():
    search, _ = searched(blocks((8, 8, 3)), (0.08, 0.08, 0.03), 1)
    assert not search.shrink()


def test_what_goes_in_only_across_stays_as_it_lies():
    rods = blocks((11, 1, 1), (11, 1, 1))
    search = VoxelSearch(rods, FreeBox((0.09, 0.09, 0.02)), VOXEL, np.random.default_rng(0))
    across = Rotation.from_euler("z", 45, degrees=True).as_matrix()
    search.begin(np.array([across, across]), np.zeros((2, 3)), np.array([0.09, 0.09, 0.02]))
    for _ in range(3):
        assert search.sweep() > 0
    assert search.poses[0] == pytest.approx(np.array([across, across]))


def test_what_is_thinner_than_a_voxel_counts():
    plate = trimesh.creation.box((0.06, 0.06, 0.002))
    bodies = unique_names([make_body("plate", plate.vertices, plate.faces)] * 2)
    search, sweeps = searched(bodies, (0.08, 0.08, 0.02), 50)
    assert sweeps is not None
    assert holds(search)


def test_zones_stay_and_are_taken_by_nobody():
    mesh = trimesh.creation.box((2 * VOXEL, 2 * VOXEL, 1.0))
    shape = free_without(STRIP, [make_body("post", mesh.vertices, mesh.faces)])
    bodies = blocks(*[(2, 2, 4)] * 8)
    search = VoxelSearch(bodies, shape, VOXEL, np.random.default_rng(0))
    search.begin(np.tile(np.eye(3), (8, 1, 1)), np.zeros((8, 3)), np.array((0.08, 0.08, 0.12)))
    assert next((k for k in range(200) if search.sweep() == 0), None) is not None
    rotation, translation = search.poses
    assert len(rotation) == len(translation) == 8
    for _ in range(3):
        matrices = file_to_world(bodies, *map(torch.from_numpy, search.poses))
        assert certify(bodies, matrices, box_of(shape, search.edges)).holds
        search.shrink()
        search.swap()
        assert next((k for k in range(200) if search.sweep() == 0), None) is not None


def test_only_wished_turns_are_tried():
    flat = Turns("none", np.eye(3)[None], False)
    bodies = [replace(one, wishes=Wishes(turns=flat)) for one in blocks(*[(2, 2, 4)] * 6)]
    search, sweeps = searched(bodies, (0.08, 0.08, 0.08), 100)
    assert sweeps is not None
    assert (search.poses[0] == np.eye(3)).all()
