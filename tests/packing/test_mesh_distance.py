"""Exact distances: beside formulas, and beside winding numbers where faces are needles."""

import itertools

import numpy as np
import pytest
import trimesh

from rasp_core.geometry.meshes import make_body
from rasp_core.packing.mesh_distance import MeshDistance

HALF = np.array([0.3, 0.2, 0.1])


def block():
    mesh = trimesh.creation.box(2 * HALF)
    return make_body("block", mesh.vertices, mesh.faces)


def to_block(points):
    beyond = np.abs(points) - HALF
    return np.linalg.norm(beyond.clip(0), axis=1) + beyond.max(1).clip(max=0)


def test_a_block_is_as_far_as_its_formula_says():
    lattice = np.stack(np.meshgrid(*3 * [np.linspace(-0.4, 0.4, 17)], indexing="ij"), -1).reshape(-1, 3)
    distances, directions = MeshDistance(block()).at(lattice)
    assert distances == pytest.approx(to_block(lattice), abs=1e-6), "points in planes with faces, too"
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1)
    points = np.random.default_rng(0).uniform(-0.4, 0.4, (500, 3))
    to_walls = np.sort(HALF - np.abs(points), axis=1)
    one_way = (to_walls[:, 0] < 0) | (to_walls[:, 1] - to_walls[:, 0] > 1e-3)
    step = 1e-4 * MeshDistance(block()).at(points)[1]
    grown = to_block(points + step) - to_block(points - step)
    assert grown[one_way] == pytest.approx(2e-4, rel=1e-2), "the way in which the distance grows"


def test_on_the_surface_the_way_is_along_the_normal():
    distances, directions = MeshDistance(block()).at(np.array([[0.3, 0.05, 0.02], [0.01, 0.2, 0.03]]))
    assert distances == pytest.approx([0, 0], abs=1e-7)
    assert directions == pytest.approx(np.eye(3)[:2])


def test_needles_do_not_change_the_side():
    """A tetrahedron of which two faces are cut into needles, some of hardly any area."""
    along = np.linspace(0, 1, 9)[1:-1, None] ** 9 * np.array([1.0, 0, 0])
    vertices = np.vstack([[(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], along])
    steps = list(itertools.pairwise([0, *range(4, 11), 1]))
    faces = [(0, 3, 2), (1, 2, 3), *((b, a, 2) for a, b in steps), *((a, b, 3) for a, b in steps)]
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    body = make_body("wedge", mesh.vertices, mesh.faces)
    points = np.random.default_rng(0).uniform(-0.2, 1.0, (2000, 3))
    inside = (points > 0).all(1) & (points.sum(1) < 1)
    distances, _ = MeshDistance(body).at(points - body.centre)
    clear = np.abs(distances) > 1e-6
    assert ((distances < 0) == inside)[clear].all()


def test_what_is_near_may_be_near():
    distance, random = MeshDistance(block()), np.random.default_rng(0)
    points = random.uniform(-0.5, 0.5, (20_000, 3))
    assert distance.maybe_within(points, 0.05)[to_block(points) <= 0.05].all()
    inside = random.uniform(-HALF, HALF, (20_000, 3))
    deep, to_node = distance.maybe_within(inside, -0.06), 0.6 / 23 * 3**0.5 / 2
    assert deep[to_block(inside) <= -0.06].all()
    assert not deep[to_block(inside) > -0.06 + 2 * to_node].any()
