"""Pools drawn and scaled, what cannot fit, and how a packing ends."""

import numpy as np
import pytest
import trimesh

from data_fetch import kitchen_like, polycubes
from rasp_core.geometry.containers import box
from rasp_core.geometry.meshes import make_body
from rasp_core.optimizer import optimize
from rasp_core.packing import result
from rasp_core.problem import Problem, Settings
from rasp_core.util.errors import InputError

ROOM = box((0.2, 0.2, 0.2))


def block(name, *edges):
    mesh = trimesh.creation.box(edges)
    return make_body(name, mesh.vertices, mesh.faces)


@pytest.fixture(scope="module")
def pool():
    return kitchen_like(24)


def test_drawing_repeats_bodies_under_new_names_by_seed():
    drawn = result.draw(polycubes(), 30, 4)
    assert [body.name for body in drawn] == [body.name for body in result.draw(polycubes(), 30, 4)]
    assert len({body.name for body in drawn}) == 30
    with pytest.raises(InputError, match="drawn"):
        result.draw(polycubes(), 0, 0)


def test_fitted_objects_make_half_the_container(pool):
    scale = result.fit_scale(pool, box((5, 5, 5)), 40)
    assert 40 * np.mean([body.scaled(scale).volume for body in pool]) == pytest.approx(62.5)
    with pytest.raises(InputError, match="fitted"):
        result.fit_scale(pool, ROOM, 0)


@pytest.mark.parametrize(
    ("edges", "room"),
    [((0.3, 0.3, 0.3), (0.2, 0.2, 0.2)), ((0.5, 0.01, 0.01), (0.2, 0.2, 0.2)), ((0.03, 0.03, 0.03), (0.2, 0.2, 0.02))],
)
def test_a_body_larger_than_the_container_is_named(edges, room):
    with pytest.raises(InputError, match=r"giant: .* larger than the container"):
        result.check_sizes([block("fine", 0.01, 0.01, 0.01), block("giant", *edges)], box(room))


def test_a_rod_along_the_diagonal_is_not_refused():
    result.check_sizes([block("rod", 0.3, 0.001, 0.001)], box((0.2, 0.2, 0.2)))


def test_an_ended_packing_is_drawn_as_the_loop_draws_it(pool):
    problem = Problem(pool[3:6], ROOM)
    found = optimize(problem, Settings(iterations=5, resolution=64))
    ended = result.finish(pool, [3, 4, 5], found.poses, ROOM, found.settings)
    assert ended.arrangement.images == pytest.approx(found.images, abs=1e-3)
    assert ended.arrangement.targets == pytest.approx(found.targets)
    assert np.array_equal(ended.arrangement.matrices, found.matrices)
