"""Boxes about two blocks, whose size is known."""

import numpy as np
import pytest
import torch
import trimesh

from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import parse
from rasp_core.geometry.meshes import make_body
from rasp_core.packing.enclosing_box import enclosing_box
from rasp_core.poses import Poses, file_to_world

BLOCK = trimesh.creation.box((0.2, 0.1, 0.1))
BODIES = [make_body(name, BLOCK.vertices, BLOCK.faces) for name in "ab"]
APART = Poses(torch.eye(3).double().repeat(2, 1, 1), torch.tensor([[1.0, 0, 0], [1.2, 0.1, 0]]).double())


@pytest.mark.parametrize(
    ("shape", "edges"),
    [("auto", (0.4, 0.2, 0.1)), ("auto:cube", (0.4, 0.4, 0.4)), ("auto:0.5,*,0.3", (0.5, 0.2, 0.3))],
)
def test_the_box_just_holds_them(shape, edges):
    container, poses = enclosing_box(BODIES, APART, parse(shape))
    assert container.size == pytest.approx(edges)
    matrices = file_to_world(BODIES, poses.rotation, poses.translation)
    assert certify(BODIES, matrices, container).holds
    between = APART.translation[1] - APART.translation[0]
    assert torch.allclose(poses.translation[1] - poses.translation[0], between)


def test_a_smaller_box_is_taken_with_poses_as_they_are():
    container, poses = enclosing_box(BODIES, APART, parse("auto"), most=np.array([0.4, 0.19, 0.1]))
    assert container.size == pytest.approx((0.4, 0.19, 0.1))
    assert poses is APART
    container, _ = enclosing_box(BODIES, APART, parse("auto"), most=np.array([0.4, 0.21, 0.1]))
    assert container.size == pytest.approx((0.4, 0.2, 0.1))


def test_what_sticks_out_of_a_fixed_edge_stays_where_it_is_along_it():
    _, poses = enclosing_box(BODIES, APART, parse("auto:0.3,*,*"))
    assert poses.translation[:, 0].tolist() == APART.translation[:, 0].tolist()
