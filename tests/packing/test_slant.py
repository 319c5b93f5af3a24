"""What fits only along a diagonal is placed by every method; turns are checked against the boxes that they give."""

import numpy as np
import pytest
import trimesh

import rasp_core as rasp
from rasp_core.geometry.containers import Container
from rasp_core.geometry.meshes import make_body
from rasp_core.packing.slant import fits_straight, is_long, slanted_turns
from rasp_core.util.errors import InputError


def block(*edges, turn=None):
    mesh = trimesh.creation.box(edges)
    if turn is not None:
        mesh.apply_transform(trimesh.transformations.euler_matrix(*turn))
    return make_body("block", mesh.vertices, mesh.faces)


ROD, BOARD = block(0.008, 0.008, 0.5), block(0.38, 0.02, 0.1)
CUBE, TRAY = rasp.box(0.3, 0.3, 0.3), rasp.box(0.3, 0.3, 0.11)


@pytest.mark.parametrize("turn", [None, (0.4, 0.9, -0.2)])
def test_a_rod_is_laid_along_each_of_the_four_diagonals(turn):
    """However it lies in its file, the rod's long axis comes to lie along a diagonal of the cube."""
    rod = block(0.008, 0.008, 0.5, turn=turn)
    axis = np.array([0, 0, 1.0])
    if turn is not None:
        axis = trimesh.transformations.euler_matrix(*turn)[:3, :3] @ axis
    turns = slanted_turns(rod, CUBE)
    assert np.allclose(turns @ turns.transpose(0, 2, 1), np.eye(3))
    assert np.allclose(np.linalg.det(turns), 1)
    along = turns @ axis
    assert np.allclose(np.abs(along), 3**-0.5, atol=1e-6)
    signs = along * np.sign(along[:, :1])
    assert len(np.unique(np.sign(signs), axis=0)) == 4


def test_a_board_stands_across_the_floor():
    """Of the turns some have a box that the tray holds."""
    boxes = [np.ptp(BOARD.vertices @ turn.T, axis=0) for turn in slanted_turns(BOARD, TRAY)]
    assert any((edges <= TRAY.size).all() for edges in boxes)


def test_what_lies_straight_is_told_apart():
    assert not fits_straight(ROD, CUBE)
    assert not fits_straight(BOARD, TRAY)
    assert fits_straight(BOARD, rasp.box(0.02, 0.38, 0.1))
    assert fits_straight(block(0.11, 0.3, 0.3), TRAY)
    assert is_long(ROD, CUBE)
    assert not is_long(block(0.1, 0.1, 0.2), CUBE)


def test_no_chord_is_long_enough_for_some():
    assert slanted_turns(block(0.01, 0.01, 0.53), CUBE).shape == (0, 3, 3)


@pytest.mark.parametrize("method", ["spectral", "dblf", "heightmap", "dense", "paper"])
def test_every_method_places_a_board_across_a_floor(method):
    search = {"dense": {"effort": 20}, "paper": {"iterations": 200}}.get(method, {})
    packed = rasp.pack([BOARD], TRAY, method=method, seed=0, resolution=64, **search)
    assert packed.certificate.holds
    assert len(packed.chosen) == 1


def test_a_rod_lies_along_a_mesh_container_that_is_itself_turned():
    """A pipe's inside at a slant: its box would hold the rod many times, no quarter turn does."""
    tube = Container(block(0.05, 0.05, 0.6, turn=(0.6, 0.5, 0.3)))
    packed = rasp.pack([block(0.02, 0.02, 0.5)], tube, method="spectral", resolution=64)
    assert packed.certificate.holds


def test_what_fits_nowhere_is_said():
    with pytest.raises(InputError, match="not one of the objects could be placed"):
        rasp.pack([block(0.1, 0.1, 0.41)], CUBE, method="spectral", resolution=64)
