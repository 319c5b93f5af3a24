"""Objects join and leave a layout with their poses."""

import torch

from data_fetch import kitchen_like
from rasp_core.packing.layout import Layout
from rasp_core.poses import Poses


def pose(x):
    return Poses(torch.eye(3)[None] * x, torch.full((1, 3), float(x)))


def test_objects_join_and_leave_with_their_poses():
    layout = Layout.empty().added(7, pose(1)).added(3, pose(2)).added(5, pose(3))
    assert layout.chosen == [7, 3, 5]
    assert len(layout) == 3
    assert layout.poses.translation[:, 0].tolist() == [1, 2, 3]
    left = layout.without(1)
    assert left.chosen == [7, 5]
    assert left.poses.translation[:, 0].tolist() == [1, 3]
    assert left.poses.rotation[:, 0, 0].tolist() == [1, 3]
    assert layout.without(None).chosen == layout.chosen
    assert layout.take([2, 0]).chosen == [5, 7]
    assert len(Layout.empty()) == 0


def test_a_layout_knows_its_objects():
    bodies = kitchen_like(4)
    assert Layout([2, 0], Poses(torch.zeros(2, 3, 3), torch.zeros(2, 3))).bodies(bodies) == [bodies[2], bodies[0]]
