"""Objects go into voids where they share least with what is there; what lies about them makes room."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from data_fetch import kitchen_like
from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import box
from rasp_core.packing import insertion
from rasp_core.packing.insertion import Voids
from rasp_core.packing.layout import Layout
from rasp_core.poses import Poses, file_to_world

ROOM = box((0.2, 0.2, 0.2))


def straight(chosen, *centres):
    rotation = torch.eye(3).repeat(len(centres), 1, 1)
    return Layout(chosen, Poses(rotation, torch.tensor(centres, dtype=torch.float32)))


@pytest.fixture
def voids():
    return Voids(kitchen_like(6), ROOM, torch.device("cpu"), np.random.default_rng(0))


def test_an_object_goes_into_the_void(voids):
    empty = voids.occupancy(Layout.empty())
    first = voids.least_shared(empty, [2], np.inf)
    assert (first.index, first.shared) == (2, 0)
    one = voids.occupancy(Layout.empty().added(first.index, first.pose))
    second = voids.least_shared(one, [0, 1], np.inf)
    assert second.index in (0, 1)
    assert voids.least_shared(one, [0, 1], 0.0) is None
    layout = one.layout.added(second.index, second.pose)
    bodies = layout.bodies(voids.pool)
    found = certify(bodies, file_to_world(bodies, layout.poses.rotation, layout.poses.translation), ROOM)
    assert found.overlap_volume < 0.05 * min(body.volume for body in bodies), "but for what voxels cannot tell"


def test_occupancy_has_the_objects_volumes(voids):
    layout = straight([0, 3], (-0.05, 0, 0), (0.05, 0, 0))
    counts = voids.occupancy(layout).counts
    volume = sum(body.volume for body in layout.bodies(voids.pool))
    assert counts.sum() * voids.room.voxel**3 == pytest.approx(volume, rel=0.1)


def test_one_object_may_be_left_out_of_sight(voids):
    both = voids.occupancy(straight([0, 1], (-0.05, 0, 0), (0.05, 0, 0)))
    without, alone = voids.occupancy_without(both, 0), voids.occupancy(straight([1], (0.05, 0, 0)))
    assert without.layout.chosen == [1]
    assert (without.counts == alone.counts).all()
    assert voids.occupancy_without(both, None) is both


def test_a_layout_is_filled_with_different_objects(voids):
    filled = voids.fill(straight([4], (0.05, 0.05, 0.05)), 2)
    assert filled.chosen[0] == 4
    assert len(filled) == 3
    assert len(set(filled.chosen)) == 3
    assert len(voids.fill(filled, 100)) <= 6
    voids.most_shared = 0.0
    assert voids.fill(filled, 2) == filled


def test_the_nearest_make_room(voids, monkeypatch):
    monkeypatch.setattr(insertion, "TUNING", replace(insertion.TUNING, movers_per_object=2))
    row = straight([0, 1, 2, 3], (-0.07, 0, 0), (0.07, 0, 0), (0, 0.07, 0), (0.05, 0, 0))
    assert voids.neighbours(row, inserted=1) == [1, 3]


def test_voxels_follow_the_container():
    long = Voids(kitchen_like(2), box((0.1, 0.4, 0.1)), torch.device("cpu"), np.random.default_rng(0))
    assert long.room.shape.argmax() == 1
    assert insertion.TUNING.fewest_voxels_along_container <= long.room.shape.max()
    assert long.room.shape.max() <= insertion.TUNING.most_voxels_along_container
