"""A box closed up is smaller, certified with its gaps, and keeps its zones."""

import numpy as np
import pytest
import trimesh

from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import FreeBox
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.zones import box_of, free_without
from rasp_core.packing.clearance import Clearance
from rasp_core.packing.closing_up import closed_up

BASE = FreeBox((0.12, 0.06, None))


def block(name, edges, at=(0, 0, 0)):
    mesh = trimesh.creation.box(edges)
    mesh.apply_translation(at)
    return make_body(name, mesh.vertices, mesh.faces)


PAIR = [block("low", (0.04, 0.04, 0.04)), block("high", (0.04, 0.04, 0.04))]


def placed(*places):
    matrices = np.tile(np.eye(4), (len(places), 1, 1))
    matrices[:, :3, 3] = places
    return matrices


@pytest.mark.parametrize("gap", [None, 0.004])
def test_what_floats_comes_down_to_what_is_below(gap):
    clearance = None if gap is None else Clearance(np.full(2, gap), gap)
    edges = np.array([0.12, 0.06, 0.2])
    post = block("post", (0.01, 0.06, 0.02), (0.05, 0, 0.01))
    shape = free_without(BASE, [post])
    matrices, smaller = closed_up(
        PAIR, placed((-0.03, 0, -0.07), (-0.03, 0, 0.05)), shape, edges, clearance, lambda: False
    )
    assert smaller[:2] == pytest.approx(edges[:2])
    assert 0.08 + 3 * (gap or 0) - 1e-4 < smaller[2] < 0.1
    asked = None if clearance is None else (clearance.parts, clearance.wall)
    assert certify(PAIR, matrices, box_of(shape, smaller), clearance=asked).holds


def test_what_cannot_get_closer_is_left():
    edges = np.array([0.12, 0.06, 0.04])
    assert closed_up(PAIR, placed((-0.03, 0, 0), (0.03, 0, 0)), BASE, edges, None, lambda: False) is None
