"""Anchors lie in their solids, as deep as a strut is thick."""

import manifold3d
import numpy as np
import pytest

from rasp_core.art.anchors import ANCHORS, base_points, inner_points


def test_anchors_are_a_radius_deep_or_in_the_middle_of_thin_walls():
    plate = manifold3d.Manifold.cube([1, 1, 0.04], True)
    block = manifold3d.Manifold.cube([1, 1, 1], True).translate([0, 0, 3])
    (thin, thick), depth = inner_points([plate, block], 0.1)
    assert len(thin) == len(thick) == ANCHORS
    assert np.median(np.abs(thin[:, 2])) == pytest.approx(0, abs=1e-4)
    inside = 0.5 - np.abs(thick - [0, 0, 3]).max(1)
    assert inside.min() > -1e-6
    assert np.median(inside) == pytest.approx(0.1, abs=0.02)
    assert np.median(depth[:ANCHORS]) == pytest.approx(0.04, abs=1e-4)
    assert depth[ANCHORS:] == pytest.approx(1, abs=1e-4)


def test_a_base_has_anchors_all_over_but_at_its_rim():
    points = base_points(np.array([0, 0, 0.0]), np.array([1, 2, 3.0]), -0.5, 0.1, 0.05)
    assert (points[:, 2] == -0.5).all()
    assert points[:, :2].min() == pytest.approx(0.2)
    assert points[:, 0].max() <= 0.8
    assert points[:, 1].max() > 1.7
