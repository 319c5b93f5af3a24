"""Shadows of lamps on walls and tilted floors, compared with projections computed by hand."""

import numpy as np
import pytest
import trimesh
from oracles import iou, thrown

from data_fetch import drawn
from rasp_core.art.room_file import room_of
from rasp_core.exact.visual_hull import visual_hull
from rasp_core.util.errors import InputError

SIZE = 128


def entries(**changes):
    """A lamp 1 m before a wall, and one above a floor that is tilted."""
    return {
        "heap": [0, 0, 1],
        "surfaces": {
            "wall": {"point": [0, 0.45, 0], "normal": [0, 1, 0]},
            "floor": {"point": [0, 0, 0.55], "normal": [0, -0.25, 1]},
        },
        "lamps": [
            {"at": [0, -0.55, 1], "onto": "wall", "height": 0.42},
            {"at": [0, 0, 1.7], "onto": "floor", "height": 0.4},
        ],
    } | changes


def squares():
    """Middle, right, up and edge of both pictures: the floor rises along y by 1 in 4."""
    along = np.array([0, 4, 1]) / np.sqrt(17)
    return [([0, 0.45, 1], [1, 0, 0], [0, 0, 1], 0.42), ([0, 0, 0.55], [1, 0, 0], along, 0.4)]


@pytest.fixture(scope="module")
def pictures():
    shapes = drawn.shapes(SIZE)
    return np.stack([shapes["heart"], shapes["star"]])


def test_what_is_dark_in_all_corrected_pictures_throws_the_pictures(pictures):
    room = room_of(entries())
    hull = visual_hull(room.corrected(pictures).astype(float), room.cameras())
    kits = room.shadows(hull.vertices, hull.faces, SIZE)
    for k, (throw, square) in enumerate(zip(room.throws, squares(), strict=True)):
        cast = thrown(hull.vertices + room.heap, hull.faces, throw.at, *square, SIZE)
        assert iou(cast, pictures[k]) > 0.95
        assert iou(cast, kits[k]) > 0.98


def test_a_cubes_shadow_is_as_large_as_similar_triangles_say():
    room = room_of(entries())
    cube = trimesh.creation.box([0.1] * 3)
    wall = room.shadows(cube.vertices, cube.faces, 420)[0]
    rows, columns = (np.flatnonzero(wall.any(axis)) for axis in (1, 0))
    # its front, 0.5 m from the lamp, is thrown onto 1 m
    assert (len(rows), len(columns)) == (200, 200)
    assert rows.mean() == columns.mean() == 209.5


def test_a_picture_on_a_wall_is_upright_and_not_mirrored():
    room = room_of(entries())
    cube = trimesh.creation.box([0.03] * 3)
    wall, floor = room.shadows(cube.vertices + np.array([0.07, 0, 0.04]), cube.faces, SIZE)
    assert np.argwhere(wall).mean(0)[0] < SIZE / 2 < np.argwhere(wall).mean(0)[1]
    assert np.argwhere(floor).mean(0)[1] > SIZE / 2
    floor = room.shadows(cube.vertices + np.array([0, 0.07, 0]), cube.faces, SIZE)[1]
    assert np.argwhere(floor).mean(0)[0] < SIZE / 2  # up on the floor is away from who looks along y


def test_up_on_a_floor_is_away_from_a_lamp_at_the_side():
    lamps = [{"at": [-0.9, 0, 1.8], "onto": "floor", "height": 0.4}]
    (throw,) = room_of(entries(lamps=lamps)).throws
    _, right, up, normal = throw.frame(np.array([0, 0, 1.0]))
    assert up[0] > 0.9
    assert normal[2] > 0.9
    assert np.cross(right, up) == pytest.approx(normal)


def test_cameras_stand_where_lamps_are():
    for throw, camera in zip(room_of(entries()).throws, room_of(entries()).cameras(), strict=True):
        assert camera.eye[:3] + np.array([0, 0, 1]) == pytest.approx(throw.at, abs=1e-12)


@pytest.mark.parametrize(
    ("lamp", "says"),
    [
        ({"at": [0, 0, 1], "onto": "wall"}, "lamp 1 stands inside the heap; move it away"),
        ({"at": [0, -0.1, 1], "onto": "wall", "height": 1}, "lamp 1 stands inside the heap, which is .* m wide"),
        ({"at": [0, -0.3, 1], "onto": "wall", "height": 0.6}, "lamp 1 is 0.3 m from a heap that is .* m wide"),
        ({"at": [0, 0.2, 1], "onto": "wall"}, "the wall is behind lamp 1"),
        ({"at": [0, 0.9, 1], "onto": "wall"}, "the wall is between lamp 1 and the heap"),
        ({"at": [0.5, 0, 1], "onto": "wall"}, "lamp 1 shines along the wall"),
        ({"at": [0, 0.5, 1.9], "onto": "floor"}, "lamp 1 stands behind the wall"),
        ({"at": [0, -0.7, 1.1], "onto": "floor", "height": 3}, "m wide|along the floor|inf"),
    ],
)
def test_where_no_shadow_can_fall_is_said(lamp, says):
    with pytest.raises(InputError, match=says):
        room_of(entries(lamps=[{"height": 0.3} | lamp, entries()["lamps"][0]]))
