"""What comes out through the open top, and what does not."""

from dataclasses import replace

import manifold3d
import numpy as np
import pytest
import trimesh

import rasp_core as rasp
from data_fetch import kitchen_like
from rasp_core.exact.pulls import Ways, follow, pull_directions, take_apart
from rasp_core.geometry.containers import Container, box
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.wishes import Wishes

ROOM = box((40, 40, 12))


def body(name, *boxes, without=()):
    """A body of boxes, each by its lowest and highest corner, without others."""
    solid, hole = (
        manifold3d.Manifold.batch_boolean(
            [manifold3d.Manifold.cube(np.subtract(high, low)).translate(low) for low, high in some],
            manifold3d.OpType.Add,
        )
        for some in (boxes, without)
    )
    mesh = (solid - hole).to_mesh64()
    return make_body(name, np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))


def apart(bodies, room=ROOM):
    return take_apart(Ways(bodies, np.tile(np.eye(4), (len(bodies), 1, 1)), room))


def test_a_stack_comes_off_from_the_top():
    stack = [body(f"{k}", ((0, 0, k), (1, 1, k + 1))) for k in (1, 0, 2)]
    found = apart(stack)
    assert [pull.name for pull in found.pulls] == ["2", "1", "0"]
    assert [pull.length for pull in found.pulls] == pytest.approx([4, 5, 6])
    assert {pull.direction for pull in found.pulls} == {(0, 0, 1)}
    assert found.holds
    assert found.summary() == "comes apart through the top, one by one, straight up"
    loading = found.to_dict()["loading"]
    assert [step["name"] for step in loading] == ["0", "1", "2"]
    assert loading[0]["direction"] == [0, 0, -1]


def test_what_lies_under_a_roof_comes_out_at_a_slant():
    table = body("table", ((0, 0, 0), (1, 6, 6)), ((1, 0, 5), (1.15, 6, 6)))
    bar = body("bar", ((1, 1, 0), (2, 2, 4.8)))
    found = apart([table, replace(bar, wishes=Wishes(fixed=True))])
    assert [pull.name for pull in found.pulls] == ["table"], "what is fixed stays"
    assert found.holds
    under = apart([replace(table, wishes=Wishes(fixed=True)), bar])
    assert under.pulls[0].direction[0] > 0
    assert under.summary().endswith("0 straight up, 1 at a slant")


def test_walls_are_in_the_way_of_slanted_pulls():
    table = body("table", ((0, 0, 0), (1, 6, 6)), ((1, 0, 5), (1.15, 6, 6)))
    bar = body("bar", ((1, 1, 0), (2, 2, 4.8)))
    narrow = Container(body("container", ((0, 0, 0), (2.05, 6, 6))))
    assert apart([replace(table, wishes=Wishes(fixed=True)), bar], narrow).stuck == ["bar"]
    assert apart([table, bar], narrow).holds, "the table is lifted off"


def test_hooks_that_hold_each_other_are_stuck():
    hook = body(
        "hook", ((0, 0, 0), (3, 1, 1)), ((0, 0, 1), (1, 1, 3)), ((0, 0, 3), (3, 1, 4)), ((2, 0, 2.2), (3, 1, 3))
    )
    held = body("held", ((1.2, 0, 1.1), (1.9, 1, 2.9)), ((1.9, 0, 1.1), (4, 1, 2.1)), ((3.2, 0, 2.1), (4, 1, 4.5)))
    rods = [body("front", ((-1, -1, -1), (5, 0, 5))), body("back", ((-1, 1, -1), (5, 2, 5)))]
    found = apart([hook, held, *rods])
    assert found.stuck == ["hook", "held"]
    assert not found.holds
    assert "2 objects cannot be pulled out through the top: hook, held" in found.summary()
    assert sorted(pull.name for pull in found.pulls) == ["back", "front"]


def test_a_bucket_is_open_where_it_is_highest_and_a_bottle_only_at_its_neck():
    wide, narrow = body("wide", ((-1, -1, 0), (1, 1, 1))), body("narrow", ((-0.4, -0.4, 1), (0.4, 0.4, 2)))
    bucket = Container(body("container", ((-2, -2, 0), (2, 2, 3)), ((-1.5, -1.5, 3), (1.5, 1.5, 4))))
    bottle = Container(body("container", ((-2, -2, 0), (2, 2, 3)), ((-0.5, -0.5, 3), (0.5, 0.5, 4))))
    assert apart([wide, narrow], bucket).holds
    assert apart([wide, narrow], bottle).stuck == ["wide"]
    ball = trimesh.creation.icosphere(radius=4)
    assert apart([wide, narrow], Container(make_body("container", ball.vertices, ball.faces))).stuck == [
        "wide",
        "narrow",
    ]


def test_a_zone_is_wall():
    room = Container(body("container", ((-2, -2, 0), (2, 2, 3)), without=[((-2, -2, 1.5), (0, 2, 2))]))
    below, beside = body("below", ((-1.9, -1, 0), (-0.1, 1, 1.4))), body("beside", ((0.1, -1, 0), (1, 1, 1.4)))
    assert apart([below, beside], room).stuck == ["below"]


def test_a_proof_follows_the_order_it_is_given():
    stack = [body(f"{k}", ((0, 0, k), (1, 1, k + 1))) for k in range(3)]
    stay, up = np.tile(np.eye(4), (3, 1, 1)), (0.0, 0.0, 1.0)
    assert follow(stack, stay, ROOM, [("2", up), ("1", up), ("0", up)]).holds
    assert follow(stack, stay, ROOM, [("2", up), ("0", up), ("1", up)]).stuck == ["0"]
    assert follow(stack, stay, ROOM, [("2", up), ("2", up), ("gone", up), ("1", up)]).stuck == ["0"]
    assert follow(stack, stay, ROOM, []).stuck == ["0", "1", "2"]


def test_pulls_go_up_straight_first():
    directions = pull_directions()
    assert directions[0].tolist() == [0, 0, 1]
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1)
    assert (np.diff(directions[:, 2]) <= 1e-12).all()
    assert directions[-1, 2] > 0.4


def test_what_is_said_to_be_free_is_free_at_samples_of_the_way():
    """Booleans at 40 samples of each way, against all that is there, for what touches: a placement without gaps."""
    packed = rasp.pack(kitchen_like(8), rasp.box(0.16, 0.16, 0.16), method="spectral")
    ways = Ways(packed.bodies, packed.matrices, packed.container)
    solids = [
        b.manifold.transform(np.hstack([m[:3, :3], m[:3, 3:] + m[:3, :3] @ b.centre[:, None]]))
        for b, m in zip(packed.bodies, packed.matrices, strict=True)
    ]
    tested = {True: 0, False: 0}
    for k in (0, 13, 28):
        for i, solid in enumerate(solids):
            for j, other in enumerate(solids):
                if i == j:
                    continue
                shared = max(
                    (solid.translate(away * ways.directions[k]) ^ other).volume() for away in np.linspace(0, 0.3, 40)
                )
                free = not ways.blocked(k, i, [j])[0]
                tested[free] += 1
                if free:
                    assert shared <= 1e-4 * min(solid.volume(), other.volume())
                else:
                    assert shared > 0
    assert min(tested.values()) > 15
