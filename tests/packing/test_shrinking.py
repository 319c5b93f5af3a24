"""Boxes get smaller, and what does not hold is not kept."""

import numpy as np
import pytest
import torch
import trimesh

from rasp_core.geometry.containers import FreeBox, box
from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.packing.shrinking import FALLING, Shrinking
from rasp_core.poses import Poses


class Loose:
    """Eight cubes one above the other on a base for four; it is never replaced, and remembers what it was asked."""

    def __init__(self, holds, least):
        mesh = trimesh.creation.box((0.1, 0.1, 0.1))
        self.bodies = unique_names([make_body("cube", mesh.vertices, mesh.faces)] * 8)
        self.shape, self.container = FreeBox((0.21, 0.21, None)), box((0.21, 0.21, 0.8))
        places = np.zeros((8, 3))
        places[:, 2] = 0.1 * (np.arange(8) - 3.5)
        self.poses = Poses(torch.eye(3).double().repeat(8, 1, 1), torch.from_numpy(places))
        self.edges = self.container.size
        self.holds, self.least, self.asked = holds, least, []

    def hold(self, poses, edges):
        self.asked.append(edges[2])
        return self.holds


def begun(best):
    """The search, and the list of what it will have compacted."""
    shrinking, found = Shrinking(best, 0.02, 0), []
    run = shrinking.compaction.run
    shrinking.compaction.run = lambda *start: found.append(run(*start)) or found[-1]
    shrinking.begin()
    return shrinking, found


def in_time():
    return False


def test_eight_cubes_come_to_two_layers():
    best = Loose(True, 0.21 * 0.21 * 0.8)
    shrinking, found = begun(best)
    for _ in range(400):
        shrinking.improve(in_time)
    best.least = np.inf
    shrinking.end(in_time)
    assert min(compacted.edges[2] for compacted in found) == pytest.approx(0.2, abs=1e-3)
    assert all(compacted.overlap < 1e-3 for compacted in found)


def test_it_falls_while_boxes_get_smaller():
    shrinking, _ = begun(Loose(True, 1.0))
    assert shrinking.falling
    shrinking.descent.improve = lambda: None
    for _ in range(FALLING):
        shrinking.improve(in_time)
    assert not shrinking.falling


def test_it_knows_how_long_compacting_takes():
    shrinking, _ = begun(Loose(True, 1.0))
    assert shrinking.seconds == 0
    while len(shrinking.free) < 2:
        shrinking.improve(in_time)
    shrinking.end(in_time)
    assert shrinking.seconds > 0
    shrinking.free.clear()
    assert shrinking.seconds == 0, "nothing is to be compacted"


def test_what_does_not_hold_is_tried_in_the_box_before():
    best = Loose(False, 1.0)
    shrinking, _ = begun(best)
    while len(shrinking.free) < 3:
        shrinking.improve(in_time)
    shrinking.end(in_time)
    assert len(best.asked) == 3
    assert shrinking.free == []


def test_what_is_no_smaller_is_not_compacted():
    best = Loose(True, 1.0)
    shrinking, _ = begun(best)
    while not shrinking.free:
        shrinking.improve(in_time)
    best.least = 1e-6
    shrinking.end(in_time)
    assert best.asked == []


def test_where_it_is_stuck_it_compacts_then_disrupts():
    shrinking, found = begun(Loose(True, 1.0))
    while not shrinking.free:
        shrinking.improve(in_time)
    disrupted = []
    shrinking.descent.improve, shrinking.descent.stuck = lambda: None, True
    shrinking.descent.disrupt = disrupted.append
    shrinking.improve(in_time)
    assert (len(found), len(disrupted)) == (1, 1)
    assert shrinking.best.asked == [found[0].edges[2]]
    assert np.array_equal(disrupted[0].translation, shrinking.best.poses.translation)
