"""Containers without zones: volumes by hand, distances, and what is refused."""

import numpy as np
import pytest
import torch
import trimesh

from rasp_core.geometry.containers import Container, FreeBox, box
from rasp_core.geometry.growing import shrunk, shrunk_shape
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.zones import box_of, free_without, without
from rasp_core.packing.voxel_correlation import Room
from rasp_core.util.errors import InputError


def block(size, at=(0, 0, 0), name="zone"):
    mesh = trimesh.creation.box(size)
    mesh.apply_translation(at)
    return make_body(name, mesh.vertices, mesh.faces)


ROOM = box((1.0, 0.8, 0.6))


def test_zones_are_cut_out_and_views_stay():
    left = without(ROOM, [block((0.2, 0.2, 2)), block((0.4, 0.1, 0.1), (0.5, 0, 0))])
    assert left.volume == pytest.approx(0.48 - 0.2 * 0.2 * 0.6 - 0.2 * 0.1 * 0.1)
    assert left.bounds == pytest.approx(ROOM.bounds)
    assert [c.to_dict() for c in left.views()] == [c.to_dict() for c in ROOM.views()]
    assert left.size is None
    points = torch.tensor([[0.0, 0, 0], [0.3, 0.2, 0.1], [0.45, 0, 0], [0.6, 0, 0]])
    assert (left.signed_distance(points)[0] < 0).tolist() == [False, True, False, False]


def test_zones_add_up_and_are_scaled():
    once = without(without(ROOM, [block((0.2, 0.2, 2))]), [block((0.1, 0.1, 0.1), (0.3, 0.2, 0))])
    assert once.base is ROOM
    assert len(once.zones) == 2
    assert once.volume == pytest.approx(0.48 - 0.024 - 0.001)
    twice = once.scaled(2.0)
    assert without(twice.base, twice.zones).volume == pytest.approx(twice.volume) == pytest.approx(8 * once.volume)


@pytest.mark.parametrize("room", [ROOM, Container(block((1.0, 0.8, 0.6), name="room"))], ids=["box", "mesh"])
def test_what_is_shrunk_keeps_clear_of_zones_too(room):
    left = shrunk(without(room, [block((0.2, 0.2, 2))]), 0.05)
    assert left.volume == pytest.approx(0.9 * 0.7 * 0.5 - 0.3 * 0.3 * 0.5, rel=0.02)
    assert left.volume <= 0.9 * 0.7 * 0.5 - (0.04 + 4 * 0.2 * 0.05 + np.pi * 0.05**2) * 0.5
    assert left.whole.volume == pytest.approx(0.48 - 0.024)


def test_voxels_of_a_zone_are_walls_however_thin_it_is():
    room = Room(without(ROOM, [block((0.001, 0.8, 0.6), (0.1, 0, 0))]), 0.05)
    wall = room.walls.any((1, 2))
    middles = room.origin[0] + room.voxel * (np.arange(room.shape[0]) + 0.5)
    assert (wall == (np.abs(middles - 0.1) < 0.0005 + 0.05 * 3**0.5 / 2)).all()
    assert wall.any()
    far = Room(without(ROOM, [block((2, 2, 2), (0, 0, -1.2)), block((0.1, 0.1, 0.1), (0, 0, -0.25))]), 0.05)
    assert far.shape[2] == 10, "the zone below the other lies outside what is left"


@pytest.mark.parametrize(
    ("zone", "told"),
    [
        (
            block((0.1, 0.1, 0.1), (2, 0, 0)),
            r"zone: lies outside the container, which reaches from -0\.5 x -0\.4 x -0\.3",
        ),
        (block((3, 3, 3)), "zone: nothing of the container is left"),
    ],
)
def test_zones_that_make_no_sense_are_refused(zone, told):
    with pytest.raises(InputError, match=told):
        without(ROOM, [zone])


def test_zones_of_a_box_to_be_found_stand_on_its_floor_whatever_its_height():
    shape = free_without(FreeBox((1.0, 0.8, None)), [block((0.2, 0.2, 3)), block((0.1, 0.1, 0.1), (0.3, 0, 0.45))])
    assert box_of(shape, np.array([1, 0.8, 0.3])).volume == pytest.approx(0.3 * (0.8 - 0.04)), "one begins above it"
    high = box_of(shape, np.array([1, 0.8, 0.6]))
    assert high.volume == pytest.approx(0.6 * (0.8 - 0.04) - 0.001)
    heights = torch.tensor([[0.3, 0.0, 0.0999], [0.3, 0, 0.1501], [0.3, 0, 0.2501]])
    assert (high.signed_distance(heights)[0] < 0).tolist() == [True, False, True], "0.4 to 0.5 above a floor at -0.3"
    assert box_of(FreeBox((1.0, 0.8, None)), np.array([1, 0.8, 0.6])).size.tolist() == [1, 0.8, 0.6]


def test_a_shape_that_is_shrunk_has_larger_zones_above_a_higher_floor():
    shape = free_without(FreeBox((1.0, 0.8, None)), [block((0.2, 0.2, 0.2), (0, 0, 0.4))])
    left = shrunk_shape(shape, 0.05)
    assert left.edges == (0.9, pytest.approx(0.7), None)
    (zone,) = left.zones
    assert zone.centre[2] == pytest.approx(0.35)
    assert zone.half_extents == pytest.approx([0.15] * 3, abs=1e-3)


@pytest.mark.parametrize(
    ("shape", "zone", "told"),
    [
        (FreeBox((None, 0.8, None)), block((0.2, 0.2, 2)), "a box whose base is given; name it, as in auto:0.3,0.2"),
        (FreeBox((1.0, 0.8, None)), block((0.2, 0.2, 2), (0, 0, -2)), "zone: lies below the box's floor"),
        (FreeBox((1.0, 0.8, None)), block((0.2, 0.2, 2), (3, 0, 0)), "zone: lies outside the container"),
        (FreeBox((1.0, 0.8, None)), block((2, 2, 2)), "nothing of the container is left"),
    ],
)
def test_zones_that_have_no_place_in_a_box_to_be_found(shape, zone, told):
    with pytest.raises(InputError, match=told):
        free_without(shape, [zone])
