"""Boxes get smaller, and what does not hold is not kept."""

from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh

from rasp_core.geometry.containers import FreeBox, box
from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.packing import voxel_descent
from rasp_core.packing.voxel_descent import VoxelDescent
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
    descent, found = VoxelDescent(best, 0.02, 0), []
    run = descent.compaction.run
    descent.compaction.run = lambda *start: found.append(run(*start)) or found[-1]
    descent.begin()
    return descent, found


def tuned(monkeypatch, **values):
    monkeypatch.setattr(voxel_descent, "TUNING", replace(voxel_descent.TUNING, **values))


def noted(done, name, do):
    """The same function, which adds its name to `done` when it is called."""
    return lambda *given: done.append(name) or do(*given)


def in_time():
    return False


def test_eight_cubes_come_to_two_layers():
    best = Loose(True, 0.21 * 0.21 * 0.8)
    descent, found = begun(best)
    for _ in range(400):
        descent.improve(in_time)
    best.least = np.inf
    descent.end(in_time)
    assert min(compacted.edges[2] for compacted in found) == pytest.approx(0.2, abs=1e-3)
    assert all(compacted.overlap < 1e-3 for compacted in found)


def test_what_does_not_hold_is_tried_in_the_box_before():
    best = Loose(False, 1.0)
    descent, _ = begun(best)
    while len(descent.free) < 3:
        descent.improve(in_time)
    descent.end(in_time)
    assert len(best.asked) == 3
    assert descent.free == []


def test_what_is_no_smaller_is_not_compacted():
    best = Loose(True, 1.0)
    descent, _ = begun(best)
    while not descent.free:
        descent.improve(in_time)
    best.least = 1e-6
    descent.end(in_time)
    assert best.asked == []


def test_where_nothing_helps_it_begins_anew_then_swaps_then_voxels_get_finer(monkeypatch):
    tuned(monkeypatch, patience=2, restarts=2, swaps=1, finest=0.5)
    descent, _ = begun(Loose(True, 1.0))
    search, overlaps, done = descent.search, iter([5.0, *[9.0] * 20]), []
    search.sweep = lambda: next(overlaps)
    for name in ("restore", "swap", "forget"):
        monkeypatch.setattr(search, name, noted(done, name, getattr(search, name)))
    after = []
    for _ in range(9):
        descent.improve(in_time)
        after.append(list(done))
        done.clear()
    assert after[0] == after[1] == [], "5, the least, then 9"
    assert after[2] == ["restore", "forget"], "patience is over"
    assert after[4] == ["restore", "forget", "restore", "swap", "forget"], "for the second time"
    assert descent.search is search
    assert (descent.least, len(descent.stuck)) == (9.0, 1)
    while descent.search is search:
        descent.improve(in_time)
    assert 0.5 * 0.02 <= descent.search.voxel < 0.02
    assert descent.stuck == []


@pytest.mark.parametrize("ends", [{"finest": 1.0}, {"most_memory": 1.0}])
def test_from_the_finest_voxels_on_or_where_their_tables_would_be_too_large_they_stay(monkeypatch, ends):
    tuned(monkeypatch, patience=1, restarts=1, swaps=0, **ends)
    descent, _ = begun(Loose(True, 1.0))
    descent.search.sweep = lambda: 1.0
    search = descent.search
    for _ in range(5):
        descent.improve(in_time)
    assert descent.search is search
