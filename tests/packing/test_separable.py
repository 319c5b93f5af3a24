"""Packings made so that they come apart: what is left out, what is put elsewhere, and what is asked besides."""

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh

from rasp_core.exact.pulls import Dismantling, Ways
from rasp_core.geometry.containers import Container, FreeBox, box
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.wishes import Wishes
from rasp_core.packing.clearance import clearance_of
from rasp_core.packing.result import finish
from rasp_core.packing.separable import check_open, locking, made_separable, proven_again
from rasp_core.poses import Poses
from rasp_core.problem import Settings
from rasp_core.util.errors import InputError

QUICK = Settings(resolution=16)
RING = trimesh.creation.torus(1.0, 0.2, major_sections=24, minor_sections=12)
LINK = RING.copy().apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0)))
CHAIN = [make_body("ring", RING.vertices, RING.faces), make_body("link", 0.98 * LINK.vertices, LINK.faces)]
BALL = trimesh.creation.icosphere(radius=0.3, subdivisions=2)
SHELL = trimesh.boolean.difference([trimesh.creation.box((3, 3, 3)), trimesh.creation.box((2, 2, 2))])
SHUT_IN = [make_body("shell", SHELL.vertices, SHELL.faces), make_body("ball", 2.5 * BALL.vertices, BALL.faces)]
PLACES = [(-0.5, 0, 0), (0.5, 0, 0)]  # of two links that hold each other


def wished(body, **wishes):
    return replace(body, wishes=Wishes(**wishes))


def packing(bodies, places, room, clearance=None):
    poses = Poses(torch.eye(3).double().repeat(len(bodies), 1, 1), torch.tensor(places, dtype=torch.float64))
    asked = None if clearance is None else (clearance.parts, clearance.wall)
    return finish(bodies, list(range(len(bodies))), poses, room, QUICK, clearance=asked)


def test_what_comes_apart_stays_as_it_is():
    room = box((6, 3, 3))
    packed = packing(CHAIN, [(-1.5, 0, 0), (1.5, 0, 0)], room)
    found = made_separable(packed, CHAIN, room)
    assert found.dismantling.holds
    assert found.arrangement is packed.arrangement


def test_the_lighter_is_left_out_where_there_is_no_room():
    room = box((3.2, 3.2, 3.2))
    found = made_separable(packing(SHUT_IN, [(0, 0, 0)] * 2, room), SHUT_IN, room)
    assert [body.name for body in found.bodies] == ["shell"]
    assert found.chosen == [0]
    assert found.dismantling.left_out == ("ball",)
    assert found.dismantling.holds
    assert found.certificate.holds
    assert found.dismantling.summary().endswith("; left out for that: ball")


@pytest.mark.parametrize("wishes", [{"must": True}, {"priority": 2.0}])
def test_what_must_go_in_or_ranks_higher_stays(wishes):
    room, pool = box((3.2, 3.2, 3.2)), [SHUT_IN[0], wished(SHUT_IN[1], **wishes)]
    assert made_separable(packing(pool, [(0, 0, 0)] * 2, room), pool, room).chosen == [1]


def test_what_is_fixed_stays_where_it_is():
    room, pool = box((3.2, 3.2, 4.2)), [SHUT_IN[0], wished(SHUT_IN[1], fixed=True)]
    pool += [make_body("other", BALL.vertices, BALL.faces)]
    packed = packing(pool, [(0, 0, -0.6), (0, 0, -0.6), (0, 0, 1.5)], room)
    found = made_separable(packed, pool, room)
    assert found.chosen == [2, 1], "what is fixed comes last"
    assert np.array_equal(found.matrices[1], packed.matrices[1])
    assert [pull.name for pull in found.dismantling.pulls] == ["other"]
    assert found.dismantling.left_out == ("shell",)


def test_what_locks_is_put_elsewhere_with_what_was_over():
    room, spare = box((3.6, 2.6, 6)), make_body("spare", BALL.vertices, BALL.faces)
    pool = [*CHAIN, spare]
    packed = replace(packing(CHAIN, [(x, y, -1.5) for x, y, _ in PLACES], room))
    found = made_separable(packed, pool, room)
    assert sorted(found.chosen) == [0, 1, 2]
    assert found.certificate.holds
    assert found.dismantling.holds
    assert not found.dismantling.left_out
    assert np.array_equal(found.matrices[found.chosen.index(0)], packed.matrices[0]), "the heavier one stays"
    assert len(made_separable(packed, pool, room, most=2).chosen) == 2


def test_a_clearance_is_kept_by_what_is_put_elsewhere():
    room, asked = box((3.6, 2.8, 6)), clearance_of(CHAIN, 0.05)
    packed = packing(CHAIN, [(x, y, -1.5) for x, y, _ in PLACES], room, asked)
    assert packed.certificate.holds
    found = made_separable(packed, CHAIN, room, asked)
    assert sorted(found.chosen) == [0, 1]
    assert found.certificate.gaps.holds
    assert found.certificate.gaps.clearance == 0.05


@pytest.mark.parametrize(
    ("shape", "grown"),
    [
        (FreeBox((3.2, 3.2, None)), [False, False, True]),
        (FreeBox((None, 3.2, 3.2)), [True, False, False]),
        (FreeBox((None, None, None), cube=True), [True, True, True]),
    ],
)
@pytest.mark.parametrize("clearance", [None, 0.05])
def test_a_box_that_is_sought_grows_until_all_are_in(shape, grown, clearance):
    asked, room = None if clearance is None else clearance_of(SHUT_IN, clearance), box((3.2, 3.2, 3.2))
    found = made_separable(packing(SHUT_IN, [(0, 0, 0)] * 2, room, asked), SHUT_IN, shape, asked)
    assert sorted(found.chosen) == [0, 1]
    assert found.certificate.holds
    assert found.dismantling.holds
    assert not found.dismantling.left_out
    assert [edge > 3.3 for edge in found.container.size] == grown
    assert found.container.size[[not some for some in grown]] == pytest.approx(3.2)


def test_what_comes_out_at_a_slant_no_more_as_the_box_grows_is_put_elsewhere_too():
    def block(low, high):
        return trimesh.creation.box(bounds=(low, high))

    # a tongue in a claw, which locks straight up, but comes out to the side in a box that is low
    claw = [block((0, 0, 0), (1, 3, 3)), block((0, 0, 0), (2.2, 3, 1)), block((0, 0, 2), (2.2, 3, 3))]
    tongue = [block((2.05, 0, 1.2), (3.5, 3, 1.9)), block((2.5, 0, 0), (3.5, 3, 3))]
    shell, ball = (mesh.copy().apply_translation((5.1, 1.5, 1.5)) for mesh in (SHELL, BALL.copy().apply_scale(2.5)))
    meshes = [trimesh.boolean.union(claw), trimesh.boolean.union(tongue), shell, ball, block((6.7, 0, 0), (9.2, 3, 3))]
    pool = [make_body(f"part_{k}", mesh.vertices, mesh.faces) for k, mesh in enumerate(meshes)]
    places = np.array([body.centre - (4.6, 1.55, 1.55) for body in pool])
    packed = packing(pool, places, box((9.2, 3.1, 3.1)))
    assert packed.certificate.holds
    assert Ways(packed.bodies, packed.matrices, packed.container).movable.all()
    found = made_separable(packed, pool, FreeBox((9.2, 3.1, None)))
    assert found.certificate.holds
    assert found.dismantling.holds
    assert len(found.bodies) == len(pool)


def test_an_opening_that_is_too_small_for_all_is_refused_before_a_search():
    bodies = [make_body("ball", BALL.vertices, BALL.faces), *CHAIN]
    neck = trimesh.creation.cone(radius=3, height=4)
    with pytest.raises(InputError, match="not one object can be pulled straight out"):
        check_open(bodies, Container(make_body("container", neck.vertices, neck.faces)))
    check_open(bodies, box((0.8, 0.8, 4)))
    check_open(bodies, FreeBox((None, None, None)))


def test_a_container_that_is_closed_at_its_top_is_refused():
    ball = trimesh.creation.icosphere(radius=3)
    room = Container(make_body("container", ball.vertices, ball.faces))
    with pytest.raises(InputError, match="not one object can be pulled straight out through the container's top"):
        made_separable(packing(CHAIN, [(-1.5, 0, 0), (1, 0, 0)], room), CHAIN, room)


def test_a_packing_that_does_not_hold_keeps_its_poses():
    room = box((3.6, 2.6, 2.6))
    packed = packing(CHAIN, [(0, 0, 0), (0.9, 0, 0)], room)
    assert not packed.certificate.holds
    found = made_separable(packed, CHAIN, room)
    assert found.arrangement is packed.arrangement
    assert not found.dismantling.holds


class Given(Ways):
    """Ways that are given: blocked `(K, N, N)`, closed `(K, N)`."""

    def __init__(self, blocked, closed):
        self.directions, self.bodies = np.zeros((len(blocked), 3)), closed[0]
        self.movable = np.ones(closed.shape[1], bool)
        self.met, self.walls = np.where(blocked, np.inf, 0), np.where(closed, np.inf, 0)


def stuck_without(blocked, closed, out):
    there = set(range(closed.shape[1])) - set(out)
    while True:
        free = {
            i for i in there for k in range(len(blocked)) if not closed[k, i] and not blocked[k, i, list(there)].any()
        }
        if not free:
            return there
        there -= free


@pytest.mark.parametrize("seed", range(12))
def test_what_is_taken_out_is_enough_and_near_the_least(seed):
    random = np.random.default_rng(seed)
    count = 7
    blocked = random.random((3, count, count)) < 0.45
    blocked[:, range(count), range(count)] = False
    closed, weight = random.random((3, count)) < 0.3, random.uniform(1, 3, count)
    locked = sorted(stuck_without(blocked, closed, []))
    out = locking(Given(blocked, closed), locked, weight)
    assert out <= set(locked)
    assert not stuck_without(blocked, closed, out)
    sets = itertools.chain.from_iterable(itertools.combinations(locked, n) for n in range(count + 1))
    least = min(weight[list(some)].sum() for some in sets if not stuck_without(blocked, closed, some))
    assert weight[sorted(out)].sum() <= 1.25 * least + 1e-9


class TestProvenAgain:
    ROOM = box((6, 3, 3))

    def judged(self, record, **more):
        packed = packing(CHAIN, [(-1.5, 0, 0), (1.5, 0, 0)], self.ROOM)
        return proven_again(packed.bodies, packed.matrices, self.ROOM, record, **more)

    def test_it_is_by_the_order_of_the_record(self):
        packed = packing(CHAIN, [(-1.5, 0, 0), (1.5, 0, 0)], self.ROOM)
        found = made_separable(packed, CHAIN, self.ROOM).dismantling
        again = self.judged(json.loads(json.dumps({"separable": found.to_dict()})))
        assert again == found
        assert self.judged({}) is None
        assert self.judged({}, wanted=True).holds
        assert self.judged({"separable": Dismantling([], []).to_dict()}).stuck == ["ring", "link"]
        fixed = {"objects": [{"name": "link", "fixed": True}], "separable": Dismantling([], []).to_dict()}
        assert self.judged(fixed).stuck == ["ring"]

    @pytest.mark.parametrize(
        "wrong",
        [
            {"loading": [{"name": "ring", "direction": [0, 0, 1]}]},
            {"loading": [{"name": "ring", "direction": [0, -1]}]},
            {"loading": [{"name": "ring"}]},
            {"loading": 3},
            {},
            [],
        ],
    )
    def test_what_cannot_be_read_is_refused(self, wrong):
        with pytest.raises(InputError, match=r"the order in the run.s result.json cannot be read"):
            self.judged({"separable": wrong})
