"""Copies in a box: more of them than it is known to hold, under a top that comes down."""

import numpy as np
import pytest
import torch
import trimesh

from data_fetch import kitchen_like
from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import Container, box
from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.geometry.zones import without
from rasp_core.packing import lowering
from rasp_core.packing.layout import Layout
from rasp_core.packing.lowering import Lowering, is_worth
from rasp_core.packing.voxel_descent import Boxed
from rasp_core.poses import Poses, file_to_world

ROOM = box((0.21, 0.21, 0.21))
CUBE = trimesh.creation.box((0.1, 0.1, 0.1))


def cubes(count):
    return unique_names([make_body("cube", CUBE.vertices, CUBE.faces)] * count)


def laid(*places):
    """Cubes as they lie, the first of a pool."""
    return Layout(
        list(range(len(places))), Poses(torch.eye(3).double().repeat(len(places), 1, 1), torch.tensor(places))
    )


FOUR = laid(*((x, y, -0.05) for x in (-0.0525, 0.0525) for y in (-0.0525, 0.0525)))


def search(pool, kept):
    return Lowering(pool, ROOM, None, np.random.default_rng(0), kept.append)


def certified(layout, pool):
    bodies = layout.bodies(pool)
    return certify(bodies, file_to_world(bodies, layout.poses.rotation, layout.poses.translation), ROOM).holds


def never():
    return False


def test_it_is_worth_where_there_are_copies_in_a_box_without_zones():
    assert is_worth(cubes(3), ROOM)
    assert not is_worth(kitchen_like(6), ROOM)
    ball = trimesh.creation.icosphere(radius=0.1)
    assert not is_worth(cubes(3), Container(make_body("ball", ball.vertices, ball.faces)))
    post = make_body("post", 0.1 * CUBE.vertices, CUBE.faces)
    assert not is_worth(cubes(3), without(ROOM, [post]))


def test_what_it_keeps_holds_and_is_more():
    pool, kept = cubes(9), []
    found, layout = search(pool, kept), FOUR
    for _ in range(300):
        found.improve(layout, never)
        layout = kept[-1] if kept else layout
        if len(layout) == 8:
            break
    assert len(layout) == 8, "all that go in"
    assert certified(layout, pool)
    counts = [len(FOUR), *(len(one) for one in kept)]
    assert counts == sorted(set(counts))
    assert kept[0].chosen[:4] == FOUR.chosen


def test_more_than_go_in_are_tried_and_those_that_do_not_are_taken_out():
    pool, kept = cubes(9), []
    found = search(pool, kept)
    found.more = 1.2  # nine cubes at once
    found._begin(FOUR)
    assert len(found.extra) == 5
    below = FOUR.poses.translation.numpy()
    nine = np.concatenate([below, below + np.array([0, 0, 0.1]), [[0, 0, 0.01]]])
    at = Boxed(np.tile(np.eye(3), (9, 1, 1)), nine, ROOM.size)
    held = found._held(at, FOUR, never)
    assert len(held) == 8
    assert certified(held, pool)
    assert found._held(at, FOUR, lambda: True) is None


def test_it_goes_on_while_it_is_more_than_the_layout_and_begins_anew_else(monkeypatch):
    pool, begun = cubes(9), []
    found = search(pool, [])
    found.more = 0.3
    begin = found._begin
    monkeypatch.setattr(found, "_begin", lambda layout: begun.append(len(layout)) or begin(layout))
    found.improve(FOUR, never)
    assert len(found.chosen) == 6
    found.descent.improve = lambda: None
    found.improve(laid(*FOUR.poses.translation.tolist(), [0, 0, 0.05]), never)
    assert begun == [4], "six are more than five"
    found.improve(laid(*FOUR.poses.translation.tolist(), *[[0, 0, 0.05]] * 3), never)
    assert begun == [4, 7]


def test_what_fails_is_tried_with_fewer_until_one_copy_is_left():
    pool = cubes(9)
    found = search(pool, [])

    def fail(more):
        found.more = more
        found._begin(FOUR)
        found.descent.improve, found.disruptions = lambda: None, lowering.TUNING.disruptions - 1
        found.descent.stuck = True
        found.improve(FOUR, never)

    fail(0.6)
    assert (len(found.extra), found.descent, found.more) == (3, None, 0.3)
    fail(0.3)
    fail(lowering.TUNING.least_more + 0.25)
    assert (len(found.extra), found.descent) == (2, None)
    fail(1.2 * lowering.TUNING.least_more)
    assert found.descent is not None, "one more, and another copy would be the same"
    assert found.more == 1.2 * lowering.TUNING.least_more


@pytest.mark.parametrize("layout", [Layout.empty(), laid(*[[0.0, 0, 0]] * lowering.MOST_BODIES)])
def test_it_needs_some_and_not_too_many(layout):
    found = search(cubes(lowering.MOST_BODIES + 1), [])
    found.improve(layout, never)
    assert found.descent is None
