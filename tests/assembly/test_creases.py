"""Creases of solids whose edges are known."""

import numpy as np
import pytest
import trimesh

from rasp_core.assembly import creases
from rasp_core.geometry.surface_points import surface_points

SPACING = 0.01


def found_on(mesh):
    points, normals = surface_points(mesh.vertices, mesh.faces, int(mesh.area / SPACING**2))
    return creases.find_creases(points, normals, SPACING)


def test_a_box_has_its_edges():
    found = found_on(trimesh.creation.box((0.4, 0.3, 0.2)))
    beyond = np.sort(np.abs(np.abs(found.points) - [0.2, 0.15, 0.1]), axis=1)
    along_edges = beyond[:, 2] > 0.03  # near corners three planes meet
    assert along_edges.sum() > 100
    assert beyond[along_edges, 1] == pytest.approx(0, abs=1e-3)
    assert (found.first * found.second).sum(1)[along_edges] == pytest.approx(0, abs=1e-3)
    assert np.median(found.weights) == pytest.approx(creases.SETTINGS.smooth_weight, abs=0.02)


def test_a_ball_has_none_and_neither_has_a_notch_inwards():
    assert len(found_on(trimesh.creation.icosphere(4, 0.2)).points) == 0
    bite = trimesh.creation.box((0.2, 0.2, 0.2))
    bite.apply_translation((0.2, 0.2, 0.2))
    notched = trimesh.creation.box((0.4, 0.4, 0.4)).difference(bite)
    inner = np.linalg.norm(found_on(notched).points - [0.15, 0.1, 0.1], axis=1)  # on an edge that bends inwards
    assert inner.min() > 2 * SPACING


def test_rough_faces_count_more():
    grid = trimesh.creation.box((0.4, 0.4, 0.1)).subdivide().subdivide().subdivide().subdivide()
    top = grid.vertices[:, 2] > 0.04
    grid.vertices[top, 2] += np.random.default_rng(0).normal(0, 0.004, top.sum())
    found = found_on(grid)
    upper = (found.points[:, 2] > 0.03) & (np.abs(found.points[:, :2]).max(1) < 0.21)
    rough = np.where(found.first[:, 2] > found.second[:, 2], found.weights[:, 0], found.weights[:, 1])
    assert np.median(rough[upper]) > 0.6
    assert np.median(rough[found.points[:, 2] < -0.03]) < 0.4


def test_too_few_points_have_no_crease():
    assert len(creases.find_creases(np.zeros((5, 3)), np.ones((5, 3)), 1.0).points) == 0


def test_each_cell_knows_its_nearest_crease_point():
    random = np.random.default_rng(1)
    some = creases.Creases(random.random((30, 3)), *np.zeros((2, 30, 3)), np.ones((30, 2)))
    lookup = creases.lookup(some, reach=0.2, cell=0.05)
    middles = lookup.origin + lookup.cell * (np.argwhere(np.ones(lookup.nearest.shape)) + 0.5)
    distances = np.linalg.norm(middles[:, None] - some.points, axis=2)
    nearest, known = distances.min(1), lookup.nearest.ravel() >= 0
    assert (known[nearest < 0.2]).all()
    at = lookup.nearest.ravel()[known]
    assert distances[known, at] == pytest.approx(nearest[known])
    assert (creases.lookup(creases.Creases(*np.zeros((3, 0, 3)), np.zeros((0, 2))), 0.2, 0.05).nearest < 0).all()


def test_creases_move_with_their_surface():
    some = found_on(trimesh.creation.box((0.4, 0.3, 0.2)))
    turn = trimesh.transformations.rotation_matrix(1.0, (1, 2, 3))[:3, :3]
    there = creases.moved(some, turn, np.array([1.0, 2, 3]))
    assert there.points == pytest.approx((turn @ some.points.T).T + np.array([1, 2, 3]))
    assert there.first == pytest.approx((turn @ some.first.T).T)
    both = creases.joined([some, there])
    assert len(both.points) == 2 * len(some.points) == len(both.weights)
