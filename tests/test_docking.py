"""Docking against places that are known: parts of wholes, where they were cut out."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from data_fetch import fracture, vessels
from rasp_core.containers import Container
from rasp_core.docking import Docking, Part, Place
from rasp_core.meshes import make_body


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
    whole, (large, _) = broken
    dock = Docking(whole)
    twin, free = dock.copy(), dock.rooms[0][1].free.sum()
    twin.put(large, true(large))
    assert dock.placed == []
    assert dock.rooms[0][1].free.sum() == free > twin.rooms[0][1].free.sum()


def test_what_has_its_place_is_no_longer_free(broken):
    whole, (large, _) = broken
    dock = Docking(whole)
    before = dock.rooms[0][1].free.sum() * dock.rooms[0][1].voxel ** 3
    assert before == pytest.approx(whole.volume, rel=0.03)
    dock.put(large, true(large))
    after = dock.rooms[0][1].free.sum() * dock.rooms[0][1].voxel ** 3
    assert before - after == pytest.approx(large.body.volume, rel=0.05)


def test_shifts_by_fourier_transforms_are_those_of_a_slow_search(broken):
    whole, (_, small) = broken
    room = Docking(whole).rooms[0][0]
    turn = Rotation.from_rotvec([0.3, 0.2, -0.4]).as_matrix()
    (found,) = room.best(small, [turn])
    share = room._share(small, turn, room.first - found.centre, room.shape)
    from scipy import ndimage

    cost = 1 - room.free + 2.0 * ndimage.gaussian_laplace(room.free, 1.0)
    assert -found.score == pytest.approx((share * cost).sum(), rel=1e-3, abs=1e-3)
    for axis in range(3):
        for step in (-1, 1):
            moved = np.roll(share, step, axis)
            assert (moved * cost).sum() >= (share * cost).sum() - 1e-3


def test_a_part_too_large_for_the_room_has_no_place(broken):
    whole, (large, _) = broken
    giant = Part(large.body.scaled(3.0))
    assert Docking(whole).places(giant, np.random.default_rng(0)) == []
