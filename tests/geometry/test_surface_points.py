"""Points spread over a surface."""

import numpy as np
import pytest
import trimesh

from rasp_core.geometry.surface_points import surface_points


def test_points_are_spread_over_the_surface_with_its_normals():
    box = trimesh.creation.box((1.0, 2.0, 4.0))
    points, normals = surface_points(box.vertices, box.faces, 5000)
    half = np.array([0.5, 1, 2])
    assert (np.abs(points) <= half + 1e-12).all()
    assert (points * normals).sum(1) == pytest.approx(np.abs(normals) @ half)
    # as many on each pair of faces as its part of the whole area, 2 * (8 + 4 + 2)
    assert np.abs(normals).mean(0) == pytest.approx(np.array([8, 4, 2]) / 14, abs=0.03)
    assert np.array_equal(points, surface_points(box.vertices, box.faces, 5000)[0])
