"""Points on surfaces: where they lie, and what they stand for."""

import numpy as np
import pytest
import torch
import trimesh

from data_fetch import kitchen_like
from rasp_core.geometry.sdf import GridStack
from rasp_core.geometry.surface_samples import MAX_SAMPLES, surface_points, surface_samples


def test_points_are_spread_over_the_surface_with_its_normals():
    box = trimesh.creation.box((1.0, 2.0, 4.0))
    points, normals = surface_points(box.vertices, box.faces, 5000)
    half = np.array([0.5, 1, 2])
    assert (np.abs(points) <= half + 1e-12).all()
    assert (points * normals).sum(1) == pytest.approx(np.abs(normals) @ half)
    # as many on each pair of faces as its part of the whole area, 2 * (8 + 4 + 2)
    assert np.abs(normals).mean(0) == pytest.approx(np.array([8, 4, 2]) / 14, abs=0.03)
    assert np.array_equal(points, surface_points(box.vertices, box.faces, 5000)[0])


def test_samples_lie_on_the_surface_and_stand_for_all_of_it():
    bodies = kitchen_like(6)
    bodies = [*bodies, bodies[0]]
    samples, stack = surface_samples(bodies), GridStack.of_bodies(bodies)
    own = torch.repeat_interleave(samples.count)
    value, _ = stack.sample(own, samples.points)
    assert (value.abs() < 0.6 * stack.spacing[own]).all()
    assert samples.count.max() <= 2 * MAX_SAMPLES
    area = torch.zeros(7).index_add_(0, own, samples.area).numpy()
    assert area == pytest.approx(np.array([b.manifold.surface_area() for b in bodies]), rel=1e-4)
    first, last = samples.start[0], samples.start[6]
    assert torch.equal(samples.points[first:][:9], samples.points[last:][:9]), "equal bodies share samples"
