"""Docking against places that are known: parts of wholes, where they were cut out."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from data_fetch import fracture, vessels
from rasp_core.assembly.registration import Docking, Part, Place, apart
from rasp_core.geometry.containers import Container
from rasp_core.geometry.meshes import make_body


@pytest.fixture(scope="module")
def broken():
    """A gravy boat, which is not symmetric about an axis, in two parts."""
    whole = vessels()[3]
    return Container(whole), [Part(body) for body in fracture(whole, 2, seed=1)]


def true(part):
    return Place(np.eye(3), part.body.centre, 0.0)


def test_a_part_is_found_where_it_was_cut_out(broken):
    whole, (large, _) = broken
    place = Docking(whole).places(large, np.random.default_rng(0))[0]
    assert not place.far_from(true(large), np.radians(2), 0.01 * 0.23)
    assert place.score > 0.6


def test_with_its_neighbour_there_the_fracture_counts_too(broken):
    whole, (large, small) = broken
    alone, beside = Docking(whole), Docking(whole)
    beside.put(large, true(large))
    (place,), (without,) = beside.draw_in(small, [true(small)]), alone.draw_in(small, [true(small)])
    assert place.score > without.score + 0.03
    assert not place.far_from(true(small), np.radians(0.5), 5e-4)


def test_a_part_is_drawn_in_from_nearby(broken):
    whole, (large, _) = broken
    off = Place(
        Rotation.from_rotvec([0.05, -0.04, 0.03]).as_matrix(), large.body.centre + np.array([3, -2, 2]) / 1000, 0.0
    )
    (place,) = Docking(whole).draw_in(large, [off])
    assert not place.far_from(true(large), np.radians(0.5), 5e-4)


def brick(name, size, centre):
    mesh = trimesh.creation.box(size)
    return make_body(name, mesh.vertices + centre, mesh.faces)


def test_the_score_is_the_share_of_surface_on_the_boundary_less_what_is_outside():
    whole = Container(brick("whole", (0.2, 0.1, 0.1), (0, 0, 0)))
    left, right = (Part(brick(name, (0.1, 0.1, 0.1), (x, 0, 0))) for name, x in (("left", -0.05), ("right", 0.05)))
    dock = Docking(whole)
    assert dock.score(left, true(left)) == pytest.approx(5 / 6, abs=0.12)  # but along edges
    assert dock.score(left, Place(np.eye(3), left.body.centre + 1.0, 0.0)) == pytest.approx(-2)
    dock.put(right, true(right))
    assert dock.score(left, true(left)) == pytest.approx(1, abs=0.15)
    # in the other's place: what is on its surface lies wrong way round, inside of nothing
    assert dock.score(left, Place(np.eye(3), right.body.centre - [0.05, 0, 0], 0.0)) < 0.5


def test_several_places_are_drawn_in_as_each_alone(broken):
    whole, (large, small) = broken
    dock = Docking(whole)
    dock.put(large, true(large))
    nearby = [Place(np.eye(3), small.body.centre + np.array(step) / 1000, 0.0) for step in ([3, 0, 0], [0, -2, 2])]
    for place, near in zip(dock.draw_in(small, nearby), nearby, strict=True):
        (alone,) = dock.draw_in(small, [near])
        np.testing.assert_allclose(place.centre, alone.centre, atol=1e-9)
        assert place.score == pytest.approx(alone.score)


def test_a_bound_does_not_draw_parts_to_it(broken):
    whole, (large, small) = broken
    bound = Docking(whole, attracts=False)
    assert bound.score(small, true(small)) == pytest.approx(0, abs=0.05)
    bound.put(large, true(large))
    assert 0.03 < bound.score(small, true(small)) < 0.5


def test_a_copy_goes_on_alone(broken):
    whole, (large, small) = broken
    dock = Docking(whole)
    twin, points = dock.copy(), len(dock.boundary)
    twin.put(large, true(large))
    assert dock.placed == []
    assert len(dock.boundary) == points != len(twin.boundary)
    third = twin.copy()
    third.move(0, Place(np.eye(3), large.body.centre + 0.01, 0.0))
    assert twin.score(small, true(small)) != pytest.approx(third.score(small, true(small)))
    assert twin.score(small, true(small)) == pytest.approx(twin.rescored(small, [true(small)])[0].score)


def test_the_boundary_is_what_nothing_covers(broken):
    """Where both parts have their places all is covered; one of them covers its own share, and bares its fracture."""
    whole, (large, small) = broken
    dock = Docking(whole)
    area = whole.body.manifold.surface_area()
    assert len(dock.boundary) == 4000
    dock.put(large, true(large))
    # the whole's surface that is left is the small part's own, so much as is not its fracture
    fracture_area = (large.area + small.area - area) / 2
    left = (dock.owner < 0).sum() / 4000 * area
    assert left == pytest.approx(small.area - fracture_area, rel=0.1)
    bared = (dock.owner == 0).sum() / 600 * large.area
    assert bared == pytest.approx(fracture_area, rel=0.35)  # but along its edges, where it is near the surface
    # its normals are those that the other part's fracture must have
    inwards = (dock.normals[dock.owner == 0] * (small.body.centre - large.body.centre)).sum(1)
    assert (inwards < 0).mean() > 0.9
    dock.put(small, true(small))
    assert len(dock.boundary) < 0.02 * 4000


def test_places_about_a_neighbour_touch_it(broken):
    whole, (large, small) = broken
    dock = Docking(whole)
    dock.put(large, true(large))
    found = dock.places(small, np.random.default_rng(0), about=0)
    assert not found[0].far_from(true(small), np.radians(2), 0.002)
    assert dock.places(small, np.random.default_rng(0), about=1) == [], "no such part, so nothing to touch"


def test_of_places_alike_the_first_is_kept():
    turn = Rotation.from_rotvec([0.0, 0.0, 0.2]).as_matrix()
    here, there = np.zeros(3), np.array([0.02, 0.0, 0.0])
    places = [
        Place(np.eye(3), here, 0.9),
        Place(turn, here, 0.8),
        Place(np.eye(3), there, 0.7),
        Place(turn, there, 0.6),
    ]
    assert apart(places, 9, 0.1, 0.01) == places
    assert apart(places, 9, 0.3, 0.01) == [places[0], places[2]]
    assert apart(places, 9, 0.3, 0.05) == places[:1]
    assert apart(places, 2, 0.1, 0.01) == places[:2]
    assert apart([], 2, 0.1, 0.01) == []


def test_a_part_too_large_for_the_room_has_no_place(broken):
    whole, (large, _) = broken
    giant = Part(large.body.scaled(3.0))
    assert Docking(whole).places(giant, np.random.default_rng(0)) == []
