"""Pools are drawn by seed, scaled to a container, and what cannot fit is named."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from data_fetch import kitchen_like, polycubes
from rasp_core.geometry.containers import Container, box
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.wishes import Wishes, turns_of
from rasp_core.packing.pool import MOST_DRAWN, Worth, check_sizes, draw, fit_scale, kind
from rasp_core.util.errors import InputError


def block(name, *edges):
    mesh = trimesh.creation.box(edges)
    return make_body(name, mesh.vertices, mesh.faces)


def test_drawing_repeats_bodies_under_new_names_by_seed():
    drawn = draw(polycubes(), 30, 4)
    assert [body.name for body in drawn] == [body.name for body in draw(polycubes(), 30, 4)]
    assert len({body.name for body in drawn}) == 30


@pytest.mark.parametrize("count", [0, MOST_DRAWN + 1])
def test_too_few_or_too_many_are_not_drawn(count):
    with pytest.raises(InputError, match=f"objects can be drawn, got {count}"):
        draw(polycubes(), count, 0)


def test_fitted_objects_make_half_the_container():
    bodies = kitchen_like(24)
    scale = fit_scale(bodies, box((5, 5, 5)), 40)
    assert 40 * np.mean([body.scaled(scale).volume for body in bodies]) == pytest.approx(62.5)
    with pytest.raises(InputError, match="fitted"):
        fit_scale(bodies, box((0.2, 0.2, 0.2)), 0)


@pytest.mark.parametrize(
    ("edges", "room"),
    [((0.3, 0.3, 0.3), (0.2, 0.2, 0.2)), ((0.5, 0.01, 0.01), (0.2, 0.2, 0.2)), ((0.03, 0.03, 0.03), (0.2, 0.2, 0.02))],
)
def test_a_body_larger_than_the_container_is_named(edges, room):
    with pytest.raises(InputError, match=r"giant: .* larger than the container"):
        check_sizes([block("fine", 0.01, 0.01, 0.01), block("giant", *edges)], box(room))


def test_sizes_are_told_in_the_unit():
    told = "giant: 300 x 10 x 10 mm is larger than the container, 100 x 100 x 100 mm"
    with pytest.raises(InputError, match=told):
        check_sizes([block("giant", 0.3, 0.01, 0.01)], box((0.1, 0.1, 0.1)), "mm")


def test_a_rod_along_the_diagonal_is_not_refused():
    check_sizes([block("rod", 0.3, 0.001, 0.001)], box((0.2, 0.2, 0.2)))


def test_no_objects_are_refused():
    with pytest.raises(InputError, match="nothing to pack"):
        check_sizes([], box((1, 1, 1)))


def test_parts_in_millimetres_are_told_from_parts_that_are_too_large():
    cube = trimesh.creation.box((30, 40, 50))
    large = make_body("large", cube.vertices, cube.faces)
    with pytest.raises(InputError, match="say so with --unit mm"):
        check_sizes([large], box((0.3, 0.2, 0.2)))
    with pytest.raises(InputError, match="enlarge the container") as refused:
        check_sizes([large], box((40, 40, 40)))
    assert "--unit" not in str(refused.value)


def test_a_vessel_as_a_container_is_told_from_its_cavity():
    outer, inner = trimesh.creation.box((1, 1, 1)), trimesh.creation.box((0.98, 0.98, 0.98))
    faces = np.concatenate([outer.faces, inner.faces[:, ::-1] + 8])
    shell = Container(make_body("shell", np.concatenate([outer.vertices, inner.vertices]), faces))
    cube = trimesh.creation.box((0.2, 0.2, 0.2))
    with pytest.raises(InputError, match=r"this is a wall 10 mm thick; its cavity, .* holds 941 l: say --cavity"):
        check_sizes([make_body("cube", cube.vertices, cube.faces)], shell)


def test_what_fits_exactly_fits():
    cube = trimesh.creation.box((0.3, 0.3, 0.3))
    single = np.asarray(cube.vertices, np.float32)  # 0.3 in 32 bits is more than 0.3
    check_sizes([make_body("cube", single, cube.faces)], box((0.3, 0.3, 0.3)))


def test_ranks_come_first_and_volume_tells_the_rest():
    edges, wishes = (1, 2, 1, 3), (Wishes(), Wishes(priority=2), Wishes(must=True), Wishes(priority=-1))
    boxes = [trimesh.creation.box([edge] * 3) for edge in edges]
    worth = Worth(
        [
            replace(make_body("b", mesh.vertices, mesh.faces), wishes=wish)
            for mesh, wish in zip(boxes, wishes, strict=True)
        ]
    )
    assert worth.rank.tolist() == [1, 2, 3, 0]
    assert worth.first(np.array([3, 1, 0, 2])).tolist() == [2, 1, 0, 3]
    assert worth.compared([2], [1, 3]) == 1, "what must go in counts more than all others"
    assert worth.compared([1, 3], [2]) == -1
    assert worth.compared([2, 3], [2]) == 0, "only volume tells"
    assert worth.more([2], [1, 3])
    assert not worth.more([1, 3], [2])
    assert worth.more([2, 3], [2])
    assert worth.more([2, 3], [2], by=26)
    assert not worth.more([2, 3], [2], by=28)
    assert not worth.more([2, 3], [3, 2]), "as much is not more"
    assert worth.volume([2, 3]) == pytest.approx(28)
    assert Worth([make_body("b", mesh.vertices, mesh.faces) for mesh in boxes]).rank.tolist() == [0] * 4


def test_bodies_of_a_kind_have_one_shape_and_the_same_turns():
    mesh = trimesh.creation.box((3, 2, 1))
    body = make_body("b", mesh.vertices, mesh.faces)
    upright = replace(body, wishes=Wishes(turns=turns_of("z", body.manifold)))
    assert kind(upright) != kind(body)
    assert kind(upright) == kind(replace(upright, name="c"))


def test_thin_containers_are_as_thick_as_they_are():
    """The grid of a thin plate may have no point inside of it."""
    ball = trimesh.creation.icosphere(radius=0.02)
    check_sizes([make_body("ball", ball.vertices, ball.faces)], box((100, 100, 0.05)))
    plate = Container(block("plate", 10, 10, 0.05))
    check_sizes([make_body("ball", ball.vertices, ball.faces)], plate)
    with pytest.raises(InputError, match="cube: "):
        check_sizes([block("cube", 1.0, 1.0, 1.0)], plate)
