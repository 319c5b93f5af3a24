"""An arrangement and its certificate, against a mesh that trimesh places and weighs."""

import numpy as np
import pytest
import trimesh

from rasp_core.exact.certificate import certify
from rasp_core.exact.certified import Certified
from rasp_core.geometry.containers import box
from rasp_core.geometry.meshes import make_body
from rasp_core.optimizer import optimize
from rasp_core.problem import Problem, Settings


def test_what_it_says_is_of_the_objects_where_they_lie():
    mesh = trimesh.creation.icosphere(subdivisions=1, radius=0.1).apply_translation((1.0, 2.0, 3.0))
    balls, room = [make_body(f"ball {k}", mesh.vertices, mesh.faces) for k in range(2)], box((0.8, 0.4, 0.4))
    settings = Settings(iterations=3, resolution=32, query_points=100)
    run = optimize(Problem(balls, room), settings)
    made = Certified(run, certify(balls, run.matrices, room))
    assert made.bodies == balls
    assert made.container is room
    assert made.density == pytest.approx(2 * mesh.volume / (0.8 * 0.4 * 0.4), rel=1e-6)
    assert made.images.shape == (len(made.cameras), 32, 32)
    for matrix, centre in zip(made.matrices, made.poses.translation.numpy(), strict=True):
        placed = mesh.copy().apply_transform(matrix)
        np.testing.assert_allclose(placed.center_mass, centre, atol=1e-6)
