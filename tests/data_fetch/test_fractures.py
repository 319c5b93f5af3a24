"""Vessels and their fractures: closed, connected, and nothing lost."""

import numpy as np
import pytest

from data_fetch import fracture, joined, vessels
from rasp_core.util.errors import InputError


@pytest.fixture(scope="module")
def wholes():
    return vessels()


def test_vessels_are_ten_closed_solids_of_one_piece(wholes):
    assert len({body.name for body in wholes}) == 10
    for body in wholes:
        assert body.manifold.volume() == pytest.approx(body.volume)
        assert len(body.manifold.decompose()) == 1
        assert 0.05 < 2 * body.half_extents.max() < 0.25
    assert len({round(body.volume * 1e9) for body in wholes}) == 10, "each has its own proportions"
    assert vessels()[3].digest == wholes[3].digest


@pytest.mark.parametrize(("which", "parts"), [(0, 2), (1, 5), (2, 10), (3, 20)])
def test_no_material_is_lost_and_nothing_is_shared(wholes, which, parts):
    whole = wholes[which]
    pieces = fracture(whole, parts, seed=1)
    assert len(pieces) == parts
    assert sum(piece.volume for piece in pieces) == pytest.approx(whole.volume, rel=1e-9)
    solids = [piece.manifold.translate(piece.centre) for piece in pieces]
    outside = sum((solid - whole.manifold.translate(whole.centre)).volume() for solid in solids)
    assert outside < 1e-9 * whole.volume
    assert all(len(solid.decompose()) == 1 for solid in solids)
    assert [piece.volume for piece in pieces] == sorted((piece.volume for piece in pieces), reverse=True)


def test_parts_joined_are_the_whole_again(wholes):
    whole = wholes[3]
    again = joined(fracture(whole, 5, seed=1))
    here, there = (body.manifold.translate(body.centre) for body in (whole, again))
    assert again.volume == pytest.approx(whole.volume, rel=1e-6)
    assert (here - there).volume() + (there - here).volume() < 1e-6 * whole.volume


def test_cuts_are_rough(wholes):
    """A plane through a cut's surface misses it by more than rounding: parts tell one another apart."""
    first, second = fracture(wholes[1], 2, seed=3)
    one = {tuple(v) for v in (first.solid_vertices + first.centre).round(9)}
    cut = np.array([v for v in (second.solid_vertices + second.centre).round(9) if tuple(v) in one])
    assert len(cut) > 50
    _, spread, _ = np.linalg.svd(cut - cut.mean(0), full_matrices=False)
    assert spread[2] / np.sqrt(len(cut)) > 0.001


def test_the_seed_decides(wholes):
    one, same, other = (fracture(wholes[0], 3, seed) for seed in (0, 0, 1))
    assert [p.digest for p in one] == [p.digest for p in same]
    assert [p.digest for p in one] != [p.digest for p in other]


def test_what_cannot_be_broken(wholes):
    with pytest.raises(InputError, match="at least two parts, got 1"):
        fracture(wholes[0], 1)


def test_where_no_cut_is_found(wholes, monkeypatch):
    monkeypatch.setattr("data_fetch.fractures.TRIES", 0)
    with pytest.raises(InputError, match="fewer parts or another seed"):
        fracture(wholes[0], 2)


def test_a_flat_cut_is_a_plane_and_a_rough_one_strays_farther(wholes):
    def astray(cut):
        first, second = fracture(wholes[1], 2, seed=3, cut=cut)
        one = {tuple(v) for v in (first.solid_vertices + first.centre).round(9)}
        points = np.array([v for v in (second.solid_vertices + second.centre).round(9) if tuple(v) in one])
        return np.linalg.svd(points - points.mean(0), compute_uv=False)[-1] / np.sqrt(len(points))

    flat, wavy, rough = map(astray, ("flat", "wavy", "rough"))
    assert flat < 1e-8
    assert 1e-4 < wavy < rough


def test_worn_cuts_have_lost_a_layer_on_both_sides(wholes):
    whole, lost = wholes[1], 0.0005
    fresh, worn = fracture(whole, 2, seed=3, cut="flat"), fracture(whole, 2, seed=3, cut="flat", lost=lost)
    section = fresh[0].manifold.surface_area() + fresh[1].manifold.surface_area() - whole.manifold.surface_area()
    gone = whole.volume - sum(piece.volume for piece in worn)
    assert gone == pytest.approx(section * lost, rel=0.05)  # half the section on each side, twice
    assert (worn[0].manifold.translate(worn[0].centre) ^ worn[1].manifold.translate(worn[1].centre)).volume() == 0


def test_an_unknown_cut_is_refused(wholes):
    with pytest.raises(InputError, match="cut 'sharp' is unknown; use one of flat, wavy, rough"):
        fracture(wholes[0], 2, cut="sharp")
