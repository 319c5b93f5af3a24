"""Gaps against distances known by hand."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from rasp_core.exact.gaps import measure
from rasp_core.geometry.containers import Container, box
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.wishes import Wishes
from rasp_core.util.errors import InputError


def cubes(*places):
    cube = trimesh.creation.box((1, 1, 1))
    bodies = [make_body(f"cube{i}", cube.vertices, cube.faces) for i in range(len(places))]
    matrices = np.tile(np.eye(4), (len(places), 1, 1))
    matrices[:, :3, 3] = places
    return bodies, matrices


def test_the_least_gaps_are_found_and_named():
    bodies, matrices = cubes((-2, 0, 0), (0, 0, 0), (1.3, 1.4, 0), (3, 3, 3))
    found = measure(bodies, matrices, box((9, 8, 10)), 0.4, 0.4)
    assert (found.least.first, found.least.second) == ("cube1", "cube2")
    assert found.least.gap == pytest.approx(0.5)  # 0.3 along x, 0.4 along y
    assert found.least_to_wall.first == "cube3"
    assert found.least_to_wall.gap == pytest.approx(0.5)
    assert found.holds
    assert found.lines() == []
    assert "least gap 0.5 m (cube1, cube2), to the wall 0.5 m (cube3)" in found.summary()
    assert "least gap 500 mm (cube1, cube2), to the wall 500 mm (cube3)" in found.summary("mm")
    assert found.to_dict()["least"]["gap"] == pytest.approx(0.5)


def test_every_gap_that_is_too_small_is_listed_worst_first():
    bodies, matrices = cubes((0, 0, 0), (1.1, 0, 0), (1.1, 1.2, 0), (-1.5, 0, 0))
    found = measure(bodies, matrices, box((4.5, 9, 9)), 0.4, 0.3)
    assert [(g.first, g.second) for g in found.short] == [
        ("cube0", "cube1"),
        ("cube1", "cube2"),
        ("cube0", "cube2"),
        ("cube3", "container"),
    ]
    assert [g.gap for g in found.short] == pytest.approx([0.1, 0.2, np.hypot(0.1, 0.2), 0.25])
    assert not found.holds
    assert "cube0 and cube1 are 0.1 m apart, 0.4 m are asked" in found.lines()[0]
    assert "cube0 and cube1 are 10 cm apart, 40 cm are asked" in found.lines("cm")[0]


def test_of_two_bodies_the_larger_clearance_counts():
    bodies, matrices = cubes((0, 0, 0), (1.2, 0, 0), (2.4, 0, 0))
    assert measure(bodies, matrices, box((9, 9, 9)), [0.1, 0.1, 0.1], 0).holds
    found = measure(bodies, matrices, box((9, 9, 9)), [0.1, 0.1, 0.3], 0)
    assert [(g.first, g.second, g.asked) for g in found.short] == [("cube1", "cube2", 0.3)]
    assert found.of(bodies).tolist() == [0.1, 0.1, 0.3]


def test_what_overlaps_or_sticks_out_has_no_gap():
    bodies, matrices = cubes((0, 0, 0), (0.5, 0, 0))
    found = measure(bodies, matrices, box((3, 0.9, 3)), 0.0, 0.1)
    assert found.least.gap == 0
    assert found.least_to_wall.gap == 0
    assert len(found.short) == 2  # both stick out; no gap between them was asked for


def test_the_wall_of_a_mesh_is_measured_as_that_of_a_box():
    bodies, matrices = cubes((0.2, 0, 0))
    room = trimesh.creation.box((3, 3, 3))
    found = measure(bodies, matrices, Container(make_body("room", room.vertices, room.faces)), 0.1, 0.85)
    assert found.least is None
    assert found.least_to_wall.gap == pytest.approx(0.8)
    assert not found.holds
    assert "(cube0)" in found.summary()


@pytest.mark.parametrize("away", [1.6, 5, 1000])
def test_what_lies_outside_a_mesh_has_no_gap_to_the_wall_however_far_it_is(away):
    bodies, matrices = cubes((away, 0, 0))
    room = trimesh.creation.box((3, 3, 3))
    found = measure(bodies, matrices, Container(make_body("room", room.vertices, room.faces)), 0.0, 0.1)
    assert found.least_to_wall.gap == 0
    assert not found.holds


@pytest.mark.parametrize(
    ("clearance", "wall", "told"),
    [
        (-0.1, 0, r"a clearance must be a length of 0 or more, got -0\.1 m"),
        ([0.1, np.nan], 0, "a clearance must be a length of 0 or more, got nan m"),
        (0.1, np.inf, "a wall clearance must be a length"),
        ([0.1, 0.1, 0.1], 0, "a clearance for each of 2 objects is needed, got 3; give as many, or one"),
    ],
)
def test_what_is_no_clearance_is_refused(clearance, wall, told):
    bodies, matrices = cubes((0, 0, 0), (2, 0, 0))
    with pytest.raises(InputError, match=told):
        measure(bodies, matrices, box((9, 9, 9)), clearance, wall)


def test_gaps_of_what_is_fixed_do_not_count():
    bodies, matrices = cubes((-1.05, 0, 0), (0, 0, 0), (1.5, 0, 0))
    fixed = [replace(body, wishes=Wishes(fixed=True)) for body in bodies]
    found = measure([*fixed[:2], bodies[2]], matrices, box((4.2, 3, 3)), 0.4, 0.05)
    assert (found.least.first, found.least.second) == ("cube1", "cube2")
    assert found.least.gap == pytest.approx(0.5)
    assert found.least_to_wall.first == "cube2"
    assert found.holds
    alone = measure(fixed, matrices, box((4.2, 3, 3)), 0.4, 0.4)
    assert alone.holds
    assert alone.summary() == "least gap is of fixed objects alone"


def test_the_tolerance_is_what_numbers_of_32_bits_lose():
    bodies, matrices = cubes((0, 0, 0), (1.25, 0, 0))
    room = box((9, 9, 9))
    assert measure(bodies, matrices, room, 0.25 + 1e-6, 0).holds
    assert not measure(bodies, matrices, room, 0.25 + 2e-6, 0).holds
