"""Samples of surfaces: where they lie, and what they stand for."""

import numpy as np
import pytest
import torch

from data_fetch import kitchen_like
from rasp_core.geometry.sdf import GridStack
from rasp_core.geometry.surface_samples import MAX_SAMPLES, surface_samples


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
