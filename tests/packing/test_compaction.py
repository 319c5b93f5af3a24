"""What is compacted touches, does not overlap by booleans, and lies in the box that is named."""

from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh
from scipy.spatial.transform import Rotation

from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import FreeBox
from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.geometry.wishes import Turns, Wishes
from rasp_core.geometry.zones import box_of, free_without
from rasp_core.packing.compaction import Compaction
from rasp_core.poses import file_to_world

STRIP, CUBE = FreeBox((0.22, 0.12, None)), FreeBox((None, None, None), cube=True)


def blocks(*edges):
    meshes = [trimesh.creation.box(one) for one in edges]
    return unique_names([make_body("block", mesh.vertices, mesh.faces) for mesh in meshes])


def moved_box(edges, place):
    mesh = trimesh.creation.box(edges)
    return mesh.vertices + place, mesh.faces


def compacted(bodies, shape, places, rotations=None, late=lambda: False):
    rotations = np.tile(np.eye(3), (len(bodies), 1, 1)) if rotations is None else rotations
    return Compaction(bodies, shape).run(rotations, np.array(places, float), np.array([0.22, 0.12, 0.4]), late)


def certified(bodies, found, spare=1e-4, shape=STRIP):
    matrices = file_to_world(bodies, torch.from_numpy(found.rotation), torch.from_numpy(found.translation))
    return certify(bodies, matrices, box_of(shape, found.edges * (1 + spare)), tolerance=1e-3).holds


def test_what_floats_comes_down():
    bodies = blocks((0.1, 0.1, 0.1), (0.1, 0.1, 0.1))
    found = compacted(bodies, STRIP, [(-0.055, 0, 0), (0.055, 0, 0.15)])
    assert found.edges == pytest.approx([0.22, 0.12, 0.1], abs=1e-4)
    assert found.overlap < 1e-4
    assert found.beyond < 1e-5
    assert certified(bodies, found)


def test_what_overlaps_is_drawn_apart_and_what_sticks_out_moved_in():
    bodies = blocks((0.1, 0.1, 0.1), (0.1, 0.1, 0.1))
    found = compacted(bodies, STRIP, [(-0.03, 0.02, 0), (0.065, 0, 0.01)])
    assert found.edges == pytest.approx([0.22, 0.12, 0.1], abs=1e-4)
    assert certified(bodies, found)


def test_a_tilted_block_lies_down():
    bodies = blocks((0.2, 0.1, 0.02))
    turned = Rotation.from_euler("y", 20, degrees=True).as_matrix()[None]
    found = compacted(bodies, FreeBox((0.25, 0.12, None)), [(0, 0, 0)], turned)
    assert found.edges[2] == pytest.approx(0.02, abs=1e-3)


def test_a_cube_stays_a_cube():
    bodies = blocks(*[(0.1, 0.1, 0.1)] * 2)
    found = compacted(bodies, CUBE, [(-0.08, 0.01, 0), (0.08, 0, 0.01)])
    assert np.ptp(found.edges) == 0
    assert found.edges[0] < 0.201
    assert certified(bodies, found)


def test_no_time_leaves_all_where_it_is():
    found = compacted(blocks((0.1, 0.1, 0.1)), STRIP, [(0, 0, 0)], late=lambda: True)
    assert found.edges == pytest.approx([0.22, 0.12, 0.1])
    assert found.translation == pytest.approx(np.zeros((1, 3)))


def test_zones_stay_on_the_floor_and_what_is_about_them_comes_down_to_them():
    """A post as high as 0.03 in the middle, a block above it and one beside it, in a box of 0.4."""
    shape = free_without(STRIP, [make_body("post", *moved_box((0.02, 0.12, 0.03), (0, 0, 0.015)))])
    bodies = blocks((0.09, 0.1, 0.1), (0.05, 0.1, 0.05))
    found = compacted(bodies, shape, [(0.06, 0, 0.05), (-0.07, 0, -0.1)])
    assert found.edges == pytest.approx([0.22, 0.12, 0.1], abs=1e-3), "beside the post"
    assert certified(bodies, found, shape=shape)
    kept = compacted(blocks((0.21, 0.1, 0.1)), shape, [(0, 0, 0.05)])
    assert kept.edges[2] == pytest.approx(0.13, abs=1e-3), "it lies on the post"
    assert kept.translation[0, 2] == pytest.approx(0.13 / 2 - 0.05, abs=1e-3)


def test_wished_turns_are_kept():
    (block,) = blocks((0.2, 0.1, 0.02))
    turned = Rotation.from_euler("zyx", [10, 20, 0], degrees=True).as_matrix()
    for word, freedom in (("none", 0.0), ("z", 1.0)):
        wished = replace(block, wishes=Wishes(turns=Turns(word, turned[None], bool(freedom))))
        found = compacted([wished], FreeBox((0.25, None, None)), [(0, 0, 0)], turned[None])
        change = Rotation.from_matrix(found.rotation[0] @ turned.T).as_rotvec()
        assert change[:2] == pytest.approx([0, 0], abs=1e-12)
        assert (abs(change[2]) > 0.05) == bool(freedom)
