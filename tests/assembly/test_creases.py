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


def test_a_ball_has_none_and_neither_has_a_notch_inwards():
    assert len(found_on(trimesh.creation.icosphere(4, 0.2)).points) == 0
    bite = trimesh.creation.box((0.2, 0.2, 0.2))
    bite.apply_translation((0.2, 0.2, 0.2))
    notched = trimesh.creation.box((0.4, 0.4, 0.4)).difference(bite)
    inner = np.linalg.norm(found_on(notched).points - [0.15, 0.1, 0.1], axis=1)  # on an edge that bends inwards
    assert inner.min() > 2 * SPACING


def test_only_a_rough_face_is_rough_and_so_are_the_creases_beside_it():
    grid = trimesh.creation.box((0.4, 0.4, 0.1)).subdivide().subdivide().subdivide().subdivide()
    top = grid.vertices[:, 2] > 0.04
    grid.vertices[top, 2] += np.random.default_rng(0).normal(0, 0.004, top.sum())
    points, normals = surface_points(grid.vertices, grid.faces, int(grid.area / SPACING**2))
    rough = creases.rough_points(points, normals, SPACING)
    upper = points[:, 2] > 0.035
    assert np.isin(np.flatnonzero(upper), rough).mean() > 0.8
    assert np.isin(np.flatnonzero(~upper), rough).mean() < 0.05
    found = creases.find_creases(points, normals, SPACING)
    beside = creases.beside(found, points[rough], SPACING)
    assert beside[found.points[:, 2] > 0.035].mean() > 0.9
    assert not beside[found.points[:, 2] < -0.03].any()
    assert not creases.beside(found, points[:0], SPACING).any()


def test_no_face_of_a_box_is_rough_and_neither_is_a_ball():
    for mesh in (trimesh.creation.box((0.4, 0.3, 0.2)), trimesh.creation.icosphere(4, 0.2)):
        points, normals = surface_points(mesh.vertices, mesh.faces, int(mesh.area / SPACING**2))
        assert len(creases.rough_points(points, normals, SPACING)) < 0.01 * len(points)
    assert len(creases.rough_points(points[:0], normals[:0], SPACING)) == 0


def test_too_few_points_have_no_crease():
    assert len(creases.find_creases(np.zeros((5, 3)), np.ones((5, 3)), 1.0).points) == 0


def test_each_cell_knows_its_nearest_crease_point():
    random = np.random.default_rng(1)
    some = creases.Creases(random.random((30, 3)), *np.zeros((2, 30, 3)))
    lookup = creases.lookup(some, reach=0.2, cell=0.05)
    middles = lookup.origin + lookup.cell * (np.argwhere(np.ones(lookup.nearest.shape)) + 0.5)
    distances = np.linalg.norm(middles[:, None] - some.points, axis=2)
    nearest, known = distances.min(1), lookup.nearest.ravel() >= 0
    assert (known[nearest < 0.2]).all()
    at = lookup.nearest.ravel()[known]
    assert distances[known, at] == pytest.approx(nearest[known])
    assert (creases.lookup(creases.Creases(*np.zeros((3, 0, 3))), 0.2, 0.05).nearest < 0).all()


def test_creases_move_with_their_surface():
    some = found_on(trimesh.creation.box((0.4, 0.3, 0.2)))
    turn = trimesh.transformations.rotation_matrix(1.0, (1, 2, 3))[:3, :3]
    there = creases.moved(some, turn, np.array([1.0, 2, 3]))
    assert there.points == pytest.approx((turn @ some.points.T).T + np.array([1, 2, 3]))
    assert there.first == pytest.approx((turn @ some.first.T).T)
    both = creases.joined([some, there])
    assert len(both.points) == 2 * len(some.points) == len(both.second)
