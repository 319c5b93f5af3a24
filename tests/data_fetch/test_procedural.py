"""The embedded sets are closed, seeded, and of the sizes they promise."""

import numpy as np
import pytest

from data_fetch import procedural
from rasp_core.geometry.shells import is_closed


@pytest.mark.parametrize("make", [procedural.kitchen_like, procedural.cad_like])
def test_series_are_closed_seeded_and_of_different_sizes(make):
    bodies = make(30)
    assert [b.digest for b in bodies] == [b.digest for b in make(30)]
    assert [b.digest for b in bodies][:5] != [b.digest for b in make(30, seed=1)][:5]
    assert len({b.digest for b in bodies}) == len({b.name for b in bodies}) == 30
    for body in bodies:
        assert is_closed(body.faces)
        assert len(body.manifold.decompose()) == 1, f"{body.name} is one piece"
        assert 0.03 < 2 * body.half_extents.max() < 0.16


def test_polycubes_fit_their_grid_with_a_gap_all_round():
    for body in procedural.polycubes(cell=0.06, gap=0.002):
        cells = procedural.POLYCUBES[body.name.removeprefix("polycube_")]
        assert 2 * body.half_extents == pytest.approx(0.06 * (np.ptp(cells, axis=0) + 1) - 0.002)
        assert body.volume == pytest.approx(len(cells) * 0.06**3, rel=0.15)
        assert body.volume < len(cells) * 0.06**3


def test_polycubes_without_gap_have_their_cells_volume():
    for body in procedural.polycubes(cell=1.0, gap=0.0):
        assert body.volume == pytest.approx(len(procedural.POLYCUBES[body.name.removeprefix("polycube_")]))


def test_a_torus_has_pappus_volume():
    assert procedural.torus(0.2, 0.05).volume == pytest.approx(2 * np.pi**2 * 0.2 * 0.05**2, rel=0.01)


def assert_one_closed_piece(body, axis, length):
    assert is_closed(body.faces)
    assert len(body.manifold.decompose()) == 1
    assert 2 * body.half_extents[axis] == pytest.approx(length)
    assert 0.2 < body.volume / np.prod(2 * body.half_extents) < 0.6


def test_a_duck_is_one_closed_piece_of_its_length():
    assert_one_closed_piece(procedural.duck(0.4), axis=0, length=0.4)


def test_a_head_is_one_closed_piece_of_its_height_with_a_nose():
    head = procedural.head(0.3)
    assert_one_closed_piece(head, axis=2, length=0.3)
    foremost = head.solid_vertices[head.solid_vertices[:, 1].argmin()]
    assert abs(foremost[0]) < 0.1 * head.half_extents[0], "the face looks to -y"
