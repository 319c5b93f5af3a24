"""Clearances are kept by every method, judged on the bodies themselves."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from rasp_core.exact.certificate import certify
from rasp_core.exact.gaps import measure
from rasp_core.geometry.containers import Container, FreeBox, box, parse
from rasp_core.geometry.growing import grown
from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.geometry.wishes import Wishes
from rasp_core.packing import methods
from rasp_core.packing.clearance import Clearance, asked_of, clearance_of
from rasp_core.problem import Settings
from rasp_core.util.errors import InputError

QUICK = Settings(query_points=2000, resolution=32, iterations=20)


def blocks_and_cans(count):
    """Convex bodies, which grow in no time."""
    shapes = [
        trimesh.creation.box((0.05, 0.04, 0.03)),
        trimesh.creation.cylinder(0.02, 0.06, sections=16),
        trimesh.creation.icosphere(1, 0.025),
        trimesh.creation.box((0.06, 0.02, 0.02)),
    ]
    return unique_names([make_body(f"part{i % 4}", shapes[i % 4].vertices, shapes[i % 4].faces) for i in range(count)])


def judged(packed, bodies, clearance, wall):
    """The packing's certificate, made again of the bodies that were given."""
    assert all(one is bodies[i] for one, i in zip(packed.bodies, packed.chosen, strict=True))
    assert packed.certificate.holds
    assert certify(packed.bodies, packed.matrices, packed.container).worst_overlap == 0
    found = measure(packed.bodies, packed.matrices, packed.container, clearance, wall)
    assert found == packed.certificate.gaps
    assert found.least is None or found.least.gap >= clearance * (1 - 1e-9)
    assert found.least_to_wall.gap >= wall * (1 - 1e-9)


@pytest.mark.parametrize(
    ("method", "budget"),
    [("paper", {}), ("dense", {"effort": 6}), ("spectral", {}), ("dblf", {}), ("heightmap", {})],
)
def test_every_method_keeps_it(method, budget):
    bodies, room = blocks_and_cans(10), box((0.12, 0.11, 0.09))
    packed = methods.search(method, bodies, room, settings=QUICK, clearance=0.004, **budget)
    judged(packed, bodies, 0.004, 0.004)
    assert packed.container is room
    assert len(packed.chosen) >= 2
    assert packed.rounds[-1]["density"] == pytest.approx(packed.density)
    assert packed.density == pytest.approx(sum(bodies[i].volume for i in packed.chosen) / room.volume)


@pytest.mark.parametrize("text", ["auto", "auto:cube", "auto:0.2,0.16,*"])
@pytest.mark.parametrize("method", ["dense", "spectral"])
def test_the_smallest_box_keeps_it_and_is_no_larger_than_that(text, method):
    bodies = blocks_and_cans(6)
    packed = methods.search(
        method, bodies, parse(text), settings=QUICK, effort=3, clearance=0.003, wall_clearance=0.005
    )
    judged(packed, bodies, 0.003, 0.005)
    if text == "auto":
        corners = np.concatenate([b.placed(m) for b, m in zip(bodies, packed.matrices, strict=True)])
        assert np.ptp(corners, axis=0) + 0.01 == pytest.approx(packed.container.size, abs=1e-12)
    if text == "auto:0.2,0.16,*":
        assert packed.container.size[:2] == pytest.approx([0.2, 0.16])


def test_walls_may_be_touched_or_kept_clear_alone():
    bodies, room = blocks_and_cans(6), box((0.14, 0.14, 0.12))
    near = methods.search("spectral", bodies, room, settings=QUICK, clearance=0.004, wall_clearance=0)
    judged(near, bodies, 0.004, 0)
    assert near.certificate.gaps.least_to_wall.gap < 0.004
    clear = methods.search("dense", bodies, room, settings=QUICK, effort=6, wall_clearance=0.006)
    judged(clear, bodies, 0, 0.006)


def test_a_mesh_as_a_container_keeps_it():
    room = Container(
        make_body("drum", (drum := trimesh.creation.cylinder(0.07, 0.12, sections=24)).vertices, drum.faces)
    )
    bodies = blocks_and_cans(8)
    packed = methods.search("dense", bodies, room, settings=QUICK, effort=6, clearance=0.003)
    judged(packed, bodies, 0.003, 0.003)


def test_what_fits_exactly_fits():
    cube = trimesh.creation.box((0.01,) * 3)
    bodies = unique_names([make_body("cube", cube.vertices, cube.faces)] * 8)
    packed = methods.search("spectral", bodies, box((0.026,) * 3), settings=QUICK, clearance=0.002)
    assert len(packed.chosen) == 8
    judged(packed, bodies, 0.002, 0.002)
    assert len(methods.search("spectral", bodies, box((0.0259,) * 3), settings=QUICK, clearance=0.002).chosen) < 8


def test_a_body_may_ask_for_more_than_the_others():
    bodies, room = blocks_and_cans(6), box((0.2, 0.16, 0.14))
    asked = [0.002] * 5 + [0.015]
    bodies[5] = replace(bodies[5], wishes=Wishes(clearance=0.015))
    packed = methods.search("spectral", bodies, room, settings=QUICK, clearance=0.002)
    assert packed.certificate.gaps.holds
    for i, one in enumerate(packed.bodies):
        for j, other in enumerate(packed.bodies[:i]):
            need = max(asked[packed.chosen[i]], asked[packed.chosen[j]])
            gap = measure([one, other], packed.matrices[[i, j]], room, 0.0, 0).least.gap
            assert gap >= need * (1 - 1e-9)


@pytest.mark.parametrize(("method", "budget"), [("dense", {"effort": 12}), ("spectral", {})])
def test_some_bodies_may_ask_for_nothing(method, budget):
    bodies = blocks_and_cans(10)
    for i in (1, 4, 7):
        bodies[i] = replace(bodies[i], wishes=Wishes(clearance=0.006))
    packed = methods.search(method, bodies, box((0.12, 0.12, 0.1)), settings=QUICK, **budget)
    assert packed.certificate.holds
    asked = np.array([0.006 if i in (1, 4, 7) else 0.0 for i in packed.chosen])
    assert (packed.certificate.gaps.of(packed.bodies) == asked).all()
    assert measure(packed.bodies, packed.matrices, packed.container, asked, 0.0).holds


def test_rounds_are_of_the_box_that_is_meant():
    bodies = blocks_and_cans(8)
    packed = methods.search("spectral", bodies, parse("auto"), settings=QUICK, clearance=0.004)
    assert np.prod(packed.rounds[-1]["box"]) * packed.rounds[-1]["density"] == pytest.approx(
        sum(body.volume for body in bodies)
    )
    assert (packed.container.size <= np.array(packed.rounds[-1]["box"]) + 1e-12).all()


def test_what_does_not_fit_with_its_clearance_is_told_as_it_is():
    cube = trimesh.creation.box((0.01,) * 3)
    body = make_body("cube", cube.vertices, cube.faces)
    told = "cube: 10 x 10 x 10 mm with 2 mm clear on all sides is larger than the container, 13 x 13 x 13 mm"
    with pytest.raises(InputError, match=told):
        methods.search("spectral", [body], box((0.013,) * 3), clearance=0.002, unit="mm")
    room = Container(make_body("room", (mesh := trimesh.creation.box((0.013,) * 3)).vertices, mesh.faces))
    with pytest.raises(InputError, match=told):
        methods.search("spectral", [body], room, clearance=0.002, unit="mm")
    told = "cube: 10 x 10 x 10 mm with 2 mm clear on all sides is larger than the container, 13 x"
    with pytest.raises(InputError, match=told):
        methods.search("spectral", [body], FreeBox((0.013, None, None)), clearance=0.002, unit="mm")


def test_what_a_run_asked_for_is_read_again():
    bodies = blocks_and_cans(3)
    gaps = measure(bodies, np.tile(np.eye(4), (3, 1, 1)), box((1, 1, 1)), [0.002, 0.001, 0.002], 0.003)
    wished, common = asked_of(bodies, {"certificate": {"gaps": gaps.to_dict()}})
    found = clearance_of(wished, **common)
    assert found.parts.tolist() == [0.002, 0.001, 0.002]
    assert found.wall == 0.003
    unwished, common = asked_of(bodies, {"certificate": {}})
    assert common == {}
    assert clearance_of(unwished) is None
    for wrong in ({}, {"certificate": []}, {"certificate": {"gaps": {"clearance": 0.1}}}):
        with pytest.raises(InputError, match=r"result\.json asks for cannot be read; give --clearance"):
            asked_of(bodies, wrong)


def test_growth_of_two_is_at_least_what_the_larger_asks():
    found = Clearance(np.array([0.0, 0.002, 0.01]), 0.002).growth
    assert (found[:, None] + found[None] >= np.maximum.outer([0, 0.002, 0.01], [0, 0.002, 0.01]) - 1e-15).all()
    assert Clearance(np.array([0.002, 0.002]), 0.0).growth.tolist() == [0.001, 0.001]


@pytest.mark.parametrize(
    ("clearance", "wall", "message"),
    [(-0.001, None, "a clearance must be a length of 0 or more, got -0.001 m"), (0.001, np.nan, "a wall clearance")],
)
def test_clearances_that_are_no_lengths_are_refused(clearance, wall, message):
    with pytest.raises(InputError, match=message):
        clearance_of(blocks_and_cans(3), clearance, wall)
    with pytest.raises(InputError, match=r"a clearance is one length in metres, got \[0\.001, 0\.002\]; give parts"):
        clearance_of(blocks_and_cans(2), [0.001, 0.002])


def test_nothing_is_asked_for_by_zeros():
    assert clearance_of(blocks_and_cans(3), 0.0, None) is None
    assert clearance_of(blocks_and_cans(3), None, None) is None
    assert clearance_of(blocks_and_cans(3), 0.002, None).wall == 0.002


def test_what_leaves_no_room_is_refused_in_the_unit():
    for container in (box((0.14, 0.14, 0.14)), parse("auto:0.14,*,*")):
        with pytest.raises(InputError, match=r"nothing of the container is 0\.0801 m from its wall"):
            methods.search("spectral", blocks_and_cans(2), container, wall_clearance=0.0801)
        with pytest.raises(InputError, match=r"nothing of the container is 80\.1 mm from its wall"):
            methods.search("spectral", blocks_and_cans(2), container, wall_clearance=0.0801, unit="mm")


def test_grown_bodies_count_as_overlapping_only_if_those_inside_come_too_near():
    cube = trimesh.creation.box((1, 1, 1))
    bodies = [grown(make_body(name, cube.vertices, cube.faces), 0.1) for name in "ab"]
    matrices = np.tile(np.eye(4), (2, 1, 1))
    matrices[1, 0, 3] = 1.2  # the grown ones reach a hair into each other
    assert certify(bodies, matrices, box((4, 4, 4))).holds
    matrices[1, 0, 3] = 1.2 - 1e-6
    assert not certify(bodies, matrices, box((4, 4, 4))).holds
    bodies[0] = make_body("a", cube.vertices, cube.faces)
    matrices[1, 0, 3] = 1.1
    assert certify(bodies, matrices, box((4, 4, 4))).holds, "only one is grown"
    matrices[1, 0, 3] = 1.1 - 1e-6
    assert not certify(bodies, matrices, box((4, 4, 4))).holds
    bodies[0] = grown(bodies[0], 0.1)
    matrices[1, 0, 3] = 1.4
    assert certify(bodies, matrices, box((4, 1.2, 1.2))).holds
    assert len(certify(bodies, matrices, box((4, 1.2 - 1e-6, 1.2))).protrusions) == 2


def test_bodies_are_grown_and_the_container_is_shrunk_by_the_rest():
    """Two that ask for 2 and 6 mm, 5 mm from the wall: half of the least, the rest of it for who asks for more."""
    bodies, asked = blocks_and_cans(2), Clearance(np.array([0.002, 0.006]), 0.005)
    assert asked.growth == pytest.approx([0.001, 0.005])
    assert asked.margin == pytest.approx(0.004)
    bodies[1] = replace(bodies[1], wishes=Wishes(clearance=0.006))
    large = [asked.grown(i, body) for i, body in enumerate(bodies)]
    for body, one, growth in zip(bodies, large, (0.001, 0.005), strict=True):
        wider = np.ptp(one.solid_vertices, axis=0) - np.ptp(body.solid_vertices, axis=0)
        assert wider == pytest.approx(2 * growth, rel=0.1)
        assert one.wishes.clearance is None


def test_who_asks_for_nothing_is_not_grown():
    (body,) = blocks_and_cans(1)
    assert Clearance(np.zeros(1), 0.0).grown(0, body).solid_vertices is body.solid_vertices
