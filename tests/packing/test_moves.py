"""Bodies that change places lie along each other's axes; the volumes of the two are near each other."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from data_fetch import kitchen_like
from rasp_core.geometry.meshes import make_body
from rasp_core.packing import moves
from rasp_core.packing.moves import Moves


def rod(name, *edges):
    mesh = trimesh.creation.box(edges)
    return make_body(name, mesh.vertices, mesh.faces)


def start(count, seed=0):
    random = np.random.default_rng(seed)
    return Rotation.random(count, random_state=random).as_matrix(), random.standard_normal((count, 3))


def test_rods_change_places_and_bearings(monkeypatch):
    """One rod is long along x, the other along z of its file."""
    monkeypatch.setattr(moves, "TUNING", replace(moves.TUNING, exchanged_axes_fraction=0.0))
    bodies = [rod("x", 0.3, 0.1, 0.05), rod("z", 0.11, 0.06, 0.32)]
    rotation, translation = start(2)
    turned, moved = Moves(bodies, np.random.default_rng(1)).swapped(rotation, translation, 0, 1)
    assert (moved == translation[::-1]).all()
    assert np.linalg.det(turned) == pytest.approx([1, 1])
    assert turned @ turned.transpose(0, 2, 1) == pytest.approx(np.stack([np.eye(3)] * 2), abs=1e-9)
    for axis_x, axis_z in ((0, 2), (1, 0), (2, 1)):  # longest, middle and shortest edges
        assert abs(turned[0][:, axis_x] @ rotation[1][:, axis_z]) == pytest.approx(1)
        assert abs(turned[1][:, axis_z] @ rotation[0][:, axis_x]) == pytest.approx(1)


def test_some_lie_askew(monkeypatch):
    monkeypatch.setattr(moves, "TUNING", replace(moves.TUNING, exchanged_axes_fraction=1.0))
    bodies = [rod("a", 0.3, 0.1, 0.05), rod("b", 0.3, 0.11, 0.05)]
    turn = np.stack([np.eye(3)] * 2)
    turned, _ = Moves(bodies, np.random.default_rng(1)).swapped(turn, np.zeros((2, 3)), 0, 1)
    assert np.abs(turned) == pytest.approx(np.round(np.abs(turned)), abs=1e-9)
    assert not np.allclose(np.abs(turned[0]), np.eye(3))


def test_either_two_change_places_or_one_turns():
    bodies = kitchen_like(6)
    rotation, translation = start(6)
    kinds = Moves(bodies, np.random.default_rng(0))
    seen = set()
    for _ in range(60):
        turned, moved = kinds.any(rotation, translation, np.zeros(6))
        elsewhere, differently = (moved != translation).any(1), (turned != rotation).any((1, 2))
        seen.add((int(elsewhere.sum()), int(differently.sum())))
    assert seen == {(2, 2), (0, 1)}
    assert (rotation == start(6)[0]).all(), "what is given stays as it was"


def test_the_same_object_twice_is_not_exchanged():
    bodies = [rod("a", 0.3, 0.1, 0.05), rod("b", 0.3, 0.1, 0.05)]
    kinds, (rotation, translation) = Moves(bodies, np.random.default_rng(0)), start(2)
    assert all((kinds.any(rotation, translation, np.ones(2))[1] == translation).all() for _ in range(20))


def test_volumes_near_each_other_change_places_more_often():
    likely = Moves([rod(f"{k}", 0.3, 0.1, 0.05 * k) for k in (1, 2, 8)], np.random.default_rng(0)).likely
    assert likely[0, 1] > likely[0, 2] > 0
    assert (np.diag(likely) == 0).all()


def test_what_overlaps_most_is_moved_most():
    bodies = kitchen_like(6)
    rotation, translation = start(6)
    kinds = Moves(bodies, np.random.default_rng(0))
    energy_of_body = np.array([0.0, 0, 0, 2.0, 0, 0])
    turned = [(kinds.any(rotation, translation, energy_of_body)[0] != rotation).any((1, 2)) for _ in range(200)]
    moved = np.array(turned).mean(0)
    assert moved[3] > moves.TUNING.by_energy_fraction - 0.1
    assert (np.delete(moved, 3) < 0.6).all()
    assert (np.delete(moved, 3) > 0).all()
