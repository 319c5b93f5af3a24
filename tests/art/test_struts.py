"""Struts between points that are seen at once where they may run."""

import manifold3d
import numpy as np
import pytest

from rasp_core.art.struts import SPARE, Strut, find_struts

LOW, HIGH = np.array([-1.0, -1, -1]), np.array([1.0, 1, 1])
LOOK = {"radius": 0.05, "margin": 0.01, "spacing": 0.08, "low": LOW, "high": HIGH}


def everywhere(points):
    return np.full(len(points), 0.2)


def around_a_block(points):
    """Hidden but for a ball of 0.5 about the middle."""
    return np.linalg.norm(points, axis=1) - 0.5


def test_solids_are_joined_along_a_shortest_tree():
    places = np.array([[-0.8, 0, 0], [0, 0, 0], [0.8, 0, 0], [0.0, 0.9, 0]])
    struts, alone = find_struts([p[None] for p in places], everywhere, **LOOK)
    assert alone == []
    assert sorted((s.first, s.second) for s in struts) == [(0, 1), (1, 2), (1, 3)]
    for strut in struts:
        assert len(strut.points) == 2
        assert strut.length == pytest.approx(np.linalg.norm(places[strut.first] - places[strut.second]))
        assert strut.radius == pytest.approx(0.1)


def test_a_strut_goes_round_what_is_seen_and_is_as_thick_as_is_hidden():
    struts, alone = find_struts([np.array([[-0.9, 0.02, 0.01]]), np.array([[0.9, 0.01, 0]])], around_a_block, **LOOK)
    (strut,) = struts
    assert alone == []
    assert len(strut.points) > 2
    samples = np.concatenate([np.linspace(a, b, 50) for a, b in zip(strut.points, strut.points[1:], strict=False)])
    assert around_a_block(samples).min() >= SPARE * strut.radius
    assert 0.05 <= strut.radius <= 0.1
    tangent = 2 * np.sqrt(0.9**2 - 0.56**2) + 0.56 * (np.pi - 2 * np.arccos(0.56 / 0.9))
    assert tangent < strut.length < 1.15 * tangent


def test_what_no_strut_reaches_is_named():
    def two_rooms(points):
        return np.abs(points[:, 0]) - 0.2

    anchors = [np.array([[x, 0.0, 0.0]]) for x in (-0.9, -0.6, 0.8)] + [np.zeros((1, 3))]
    struts, alone = find_struts(anchors, two_rooms, **LOOK)
    assert [(s.first, s.second) for s in struts] == [(0, 1)]
    assert alone == [2, 3]
    assert find_struts(anchors[3:] * 2, two_rooms, **LOOK)[0] == []


def test_near_solids_are_joined_more_often_than_a_tree_needs():
    corners = [np.array([[x, y, 0.0]]) for x in (-0.15, 0.15) for y in (-0.15, 0.15)]
    struts, _ = find_struts(corners, everywhere, **LOOK)
    assert len(struts) >= 4


def test_a_rod_holds_every_point_within_its_radius():
    rod = Strut(0, 1, np.array([[0, 0, 0], [1.0, 0, 0], [1, 1, 0]]), 0.1).solid()
    assert len(rod.decompose()) == 1
    turns = np.linspace(0, 2 * np.pi, 40)
    ring = np.column_stack([np.full(40, 0.5), 0.1 * np.cos(turns), 0.1 * np.sin(turns)])
    for point in ring:
        speck = manifold3d.Manifold.cube([1e-4] * 3, True).translate(0.9999 * point - [0, 0, 0])
        assert (speck - rod).volume() < 1e-3 * speck.volume()


def test_what_is_joined_already_needs_no_strut():
    places = [np.array([[x, 0.0, 0.0]]) for x in (-0.8, 0.0, 0.8)]
    struts, alone = find_struts(places, everywhere, **LOOK, joined=[(0, 1)])
    assert [(s.first, s.second) for s in struts] == [(1, 2)]
    assert alone == []
