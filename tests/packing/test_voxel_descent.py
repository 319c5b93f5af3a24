"""Boxes of voxels get smaller; what is done where nothing helps."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from rasp_core.geometry.containers import FreeBox
from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.packing import voxel_descent
from rasp_core.packing.voxel_descent import Boxed, VoxelDescent

VOXEL = 0.02


@pytest.fixture
def tower():
    """Eight cubes one above the other, on a base for four."""
    places = np.zeros((8, 3))
    places[:, 2] = 0.1 * (np.arange(8) - 3.5)
    return Boxed(np.tile(np.eye(3), (8, 1, 1)), places, np.array([0.21, 0.21, 0.8]))


@pytest.fixture
def descent(tower):
    mesh = trimesh.creation.box((0.1, 0.1, 0.1))
    bodies = unique_names([make_body("cube", mesh.vertices, mesh.faces)] * 8)
    found = VoxelDescent(bodies, FreeBox((0.21, 0.21, None)), VOXEL, 0)
    found.begin(tower)
    return found


def tuned(monkeypatch, **values):
    monkeypatch.setattr(voxel_descent, "TUNING", replace(voxel_descent.TUNING, **values))


def noted(done, name, do):
    """The same function, which adds its name to `done` when it is called."""
    return lambda *given: done.append(name) or do(*given)


def test_boxes_that_are_free_get_smaller(descent):
    free = [one for one in (descent.improve() for _ in range(300)) if one is not None]
    heights = [one.edges[2] for one in free]
    assert heights == sorted(heights, reverse=True)
    assert heights[-1] < 0.3, "towards two layers"
    assert all((np.abs(one.translation[:, 2]) <= one.edges[2] / 2).all() for one in free)


def test_a_box_that_cannot_get_smaller_is_where_it_is_stuck(descent, tower):
    descent.search.shrink = lambda: False
    assert descent.improve().edges == pytest.approx(tower.edges)
    assert descent.stuck
    descent.disrupt(tower)
    assert not descent.stuck


def test_where_nothing_helps_it_begins_anew_then_swaps_then_voxels_get_finer(monkeypatch, descent, tower):
    tuned(monkeypatch, patience=2, restarts=2, swaps=1, finest=0.5)
    search, overlaps, done = descent.search, iter([5.0, *[9.0] * 20]), []
    search.sweep = lambda: next(overlaps)
    for name in ("restore", "swap", "forget"):
        monkeypatch.setattr(search, name, noted(done, name, getattr(search, name)))
    after = []
    for _ in range(5):
        assert descent.improve() is None
        after.append(list(done))
        done.clear()
    assert after[0] == after[1] == [], "5, the least, then 9"
    assert after[2] == ["restore", "forget"], "patience is over"
    assert descent.stuck, "for the second time"
    descent.disrupt(tower)
    assert done == ["restore", "swap", "forget"]
    assert descent.search is search
    assert (descent.least, len(descent.tried)) == (np.inf, 1)
    while not descent.stuck:
        descent.improve()
    descent.disrupt(tower)
    assert 0.5 * VOXEL <= descent.search.voxel < VOXEL
    assert descent.tried == []


@pytest.mark.parametrize("ends", [{"finest": 1.0}, {"most_memory": 1.0}])
def test_from_the_finest_voxels_on_or_where_their_tables_would_be_too_large_they_stay(
    monkeypatch, descent, tower, ends
):
    tuned(monkeypatch, swaps=0, **ends)
    search = descent.search
    for _ in range(5):
        descent.disrupt(tower)
    assert descent.search is search
