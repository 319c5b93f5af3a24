"""Boxes get smaller, and what does not hold is not kept."""

import numpy as np
import pytest
import torch
import trimesh

from rasp_core.geometry.containers import FreeBox
from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.packing.voxel_descent import TUNING, VoxelDescent
from rasp_core.poses import Poses


def begun(hold):
    """Eight cubes one above the other on a base for four."""
    mesh = trimesh.creation.box((0.1, 0.1, 0.1))
    bodies = unique_names([make_body("cube", mesh.vertices, mesh.faces)] * 8)
    descent = VoxelDescent(bodies, FreeBox((0.21, 0.21, None)), 0.02, 0, hold)
    places = np.zeros((8, 3))
    places[:, 2] = 0.1 * (np.arange(8) - 3.5)
    descent.begin(Poses(torch.eye(3).double().repeat(8, 1, 1), torch.from_numpy(places)), np.array([0.21, 0.21, 0.8]))
    return descent


def test_eight_cubes_come_to_two_layers():
    found = []
    descent = begun(lambda compacted: found.append(compacted) or True)
    for _ in range(400):
        descent.improve(0.21 * 0.21 * 0.8, lambda: False)
    descent.compact(np.inf, lambda: False)
    assert min(compacted.edges[2] for compacted in found) == pytest.approx(0.2, abs=1e-3)
    assert all(compacted.overlap < 1e-3 for compacted in found)


def test_what_does_not_hold_is_tried_in_the_box_before():
    asked = []
    descent = begun(lambda compacted: asked.append(compacted.edges[2]) and False)
    while len(descent.free) < 3:
        descent.improve(1.0, lambda: False)
    descent.compact(1.0, lambda: False)
    assert len(asked) == 3
    assert descent.free == []
    assert descent.sweeps == 0
    assert TUNING.sweeps > 1


def test_what_is_no_smaller_is_not_compacted():
    asked = []
    descent = begun(lambda compacted: asked.append(1) or True)
    while not descent.free:
        descent.improve(1.0, lambda: False)
    descent.compact(1e-6, lambda: False)
    assert asked == []
