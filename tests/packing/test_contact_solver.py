"""Bodies that overlap are pushed apart just so far; what is not touched stays; the same whoever computes it."""

import numpy as np
import pytest
import torch
import trimesh

from data_fetch import kitchen_like
from rasp_core.geometry.containers import Container, box
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.surface_samples import surface_samples
from rasp_core.packing.contact_solver import BLOCK_SAMPLES, Relaxation, _in_blocks

ROOM = box((8, 8, 8))
FOREVER = np.full(40, np.inf)


def straight(*places):
    return np.eye(3)[None, None].repeat(len(places), 1), np.array([places], float)


def test_two_balls_come_apart_and_a_third_stays(two_balls):
    balls = [*two_balls, make_body("third", two_balls[0].vertices, two_balls[0].faces)]
    pressed = Relaxation(balls)
    turn, place = straight((-0.9, 0, 0), (0.9, 0, 0), (0, 2.5, 2))
    energy, _, found, share = pressed.run(turn, place, ROOM, 0.005, FOREVER)
    assert energy[0] < 1e-9 * pressed.unit
    assert np.linalg.norm(found[0, 1] - found[0, 0]) == pytest.approx(2.01, abs=0.005)
    assert found[0, 2] == pytest.approx(place[0, 2], abs=1e-12)
    assert share[0].sum() == pytest.approx(energy[0])
    assert share[0, 2] == 0
    assert (place == straight((-0.9, 0, 0), (0.9, 0, 0), (0, 2.5, 2))[1]).all(), "what was given stays as it was"


@pytest.mark.parametrize("mesh", [False, True])
def test_a_body_beyond_the_wall_is_drawn_in(two_balls, mesh):
    hall = trimesh.creation.box((4, 4, 4))
    room = Container(make_body("hall", hall.vertices, hall.faces)) if mesh else box((4, 4, 4))
    _, _, found, _ = Relaxation(two_balls[:1]).run(*straight((0, 1.3, 0)), room, 0.0, FOREVER)
    assert found[0, 0] == pytest.approx([0, 1, 0], abs=0.02)


def test_where_there_is_no_room_the_overlap_is_shared(two_balls):
    """Two balls of radius 1 in a box 3.6 long: as deep in the walls as in each other, so that each of the three
    overlaps is some 0.13 deep."""
    pressed = Relaxation(two_balls)
    energy, _, found, _ = pressed.run(*straight((-0.5, 0, 0), (0.5, 0, 0)), box((3.6, 2.2, 2.2)), 0.0, FOREVER)
    assert energy[0] > 1e-6 * pressed.unit
    assert found[0, 0] == pytest.approx(-found[0, 1], abs=0.02)
    assert 0.8 < found[0, 1, 0] < 1.0


def test_what_weighs_more_overlaps_less(two_balls):
    """Three balls in a row in a box that is 0.6 too short."""
    balls = [*two_balls, make_body("third", two_balls[0].vertices, two_balls[0].faces)]
    start, room = straight((-1.7, 0, 0), (0, 0, 0), (1.7, 0, 0)), box((5.4, 2.2, 2.2))
    even, heavy = (
        Relaxation(balls).run(*start, room, 0.0, FOREVER, w)[2][0, :, 0] for w in (None, np.array([9.0, 1, 1]))
    )
    assert even[1] - even[0] == pytest.approx(even[2] - even[1], abs=0.02)
    assert heavy[1] - heavy[0] > heavy[2] - heavy[1] + 0.03


def test_starts_do_not_know_of_each_other_nor_of_threads(monkeypatch):
    bodies, room = kitchen_like(8), box((0.2, 0.2, 0.2))
    pressed, random = Relaxation(bodies, 4.0), np.random.default_rng(0)
    place = 0.05 * random.standard_normal((3, 8, 3))
    turn = np.eye(3)[None, None].repeat(3, 0).repeat(8, 1)
    together = pressed.run(turn, place, room, 1e-4, FOREVER)
    monkeypatch.setattr(torch, "get_num_threads", lambda: 1)
    for start in range(3):
        alone = pressed.run(turn[start, None], place[start, None], room, 1e-4, FOREVER)
        for a, b in zip(alone, together, strict=True):
            assert np.array_equal(a[0], b[start])
    assert (together[0] < pressed.run(turn, place, room, 1e-4, FOREVER[:1])[0]).all()


def test_a_start_above_its_ceiling_is_given_up(two_balls):
    pressed, start = Relaxation(two_balls), straight((-0.9, 0, 0), (0.9, 0, 0))
    before = pressed.run(*start, ROOM, 0.0, FOREVER[:1])[0]
    energy, turn, place, _ = pressed.run(*start, ROOM, 0.0, np.zeros(40))
    assert energy == before > 0
    assert (turn == start[0]).all()
    assert (place == start[1]).all()


def test_every_sample_lies_in_one_small_block():
    bodies = [*kitchen_like(3), *kitchen_like(1)]
    points, area, first, centre, radius, first_block = _in_blocks(bodies, 4.0)
    samples = surface_samples(bodies, spacing=4.0)
    assert np.diff(first).max() <= BLOCK_SAMPLES
    block = np.repeat(np.arange(len(centre)), np.diff(first))
    assert (np.linalg.norm(points - centre[block], axis=1) <= radius[block] + 1e-9).all()
    for body in range(len(bodies)):
        rows = slice(first[first_block[body]], first[first_block[body + 1]])
        given = samples.points[samples.start[body] :][: samples.count[body]].numpy()
        assert {tuple(p) for p in points[rows].tolist()} == {tuple(p) for p in given.tolist()}
        assert area[rows].sum() == pytest.approx(bodies[body].manifold.surface_area(), rel=1e-5)
