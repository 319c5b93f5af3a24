"""Packings about what is there already and beside zones that stay free, judged on the solids themselves."""

import manifold3d
import numpy as np
import pytest
import torch
import trimesh

import rasp_core as rasp
from rasp_core.exact.certificate import certify
from rasp_core.exact.gaps import measure
from rasp_core.exact.placing import placed_solid
from rasp_core.geometry.meshes import make_body, named_apart, unique_names
from rasp_core.packing import around
from rasp_core.packing.around import pack_apart
from rasp_core.packing.clearance import Clearance
from rasp_core.packing.result import finish
from rasp_core.poses import Poses
from rasp_core.problem import Settings
from rasp_core.util.errors import InputError

QUICK = {"resolution": 32}
ROOM = (0.14, 0.12, 0.1)


def block(name, size, at=(0, 0, 0)):
    mesh = trimesh.creation.box(size)
    mesh.apply_translation(at)
    return make_body(name, mesh.vertices, mesh.faces)


def blocks(count):
    sizes = [(0.05, 0.04, 0.03), (0.06, 0.02, 0.02), (0.03, 0.03, 0.03)]
    return unique_names([block(f"part{i % 3}", sizes[i % 3]) for i in range(count)])


THERE = [block("part0", (0.05, 0.04, 0.03), (-0.02, 0.01, -0.03)), block("jig", (0.03, 0.03, 0.03), (0.04, 0.02, 0.02))]


@pytest.mark.parametrize("clearance", [None, 0.003])
@pytest.mark.parametrize(("method", "budget"), [("spectral", {}), ("dense", {"effort": 6})])
def test_parts_go_around_what_is_fixed(method, budget, clearance):
    packed = rasp.pack(blocks(9), rasp.box(*ROOM), method, fixed=THERE, clearance=clearance, **budget, **QUICK)
    assert packed.certificate.holds
    assert packed.fixed == ["part0", "jig"]
    assert len(packed.chosen) == len(packed.bodies) - 2 >= 3
    assert np.array_equal(packed.matrices[-2:], np.tile(np.eye(4), (2, 1, 1)))
    assert len({body.name for body in packed.bodies}) == len(packed.bodies)
    for body, matrix in zip(packed.bodies[:-2], packed.matrices[:-2], strict=True):
        for other in THERE:
            solid = placed_solid(other, np.eye(4))
            assert (placed_solid(body, matrix) ^ solid).volume() <= 1e-4 * min(body.volume, other.volume)
            if clearance:
                assert placed_solid(body, matrix).min_gap(solid, 1) >= clearance * (1 - 1e-9)
    assert packed.density == pytest.approx(sum(body.volume for body in packed.bodies) / np.prod(ROOM))
    assert f"{len(packed.chosen)} of 9 objects around 2" in repr(packed)
    with pytest.raises(InputError, match="leave out --settle or --fixed"):
        packed.settle()


def test_the_paper_packs_around_what_is_fixed():
    packed = rasp.pack(blocks(6), rasp.box(*ROOM), fixed=THERE, iterations=20, query_points=2000, **QUICK)
    assert packed.certificate.holds
    assert packed.chosen
    assert certify(packed.bodies, packed.matrices, rasp.box(*ROOM)).holds


def test_a_run_may_be_gone_on_with(tmp_path):
    first = rasp.pack(blocks(3), rasp.box(*ROOM), "spectral", clearance=0.002, **QUICK)
    first.save(tmp_path / "run")
    for there in (tmp_path / "run", tmp_path / "run" / "scene.glb"):
        again = rasp.pack(blocks(4), rasp.box(*ROOM), "spectral", fixed=there, clearance=0.002, **QUICK)
        assert again.certificate.holds
        assert sorted(again.fixed) == ["part0", "part1", "part2"]
        assert {body.name for body in again.bodies[:-3]} <= {"part0#2", "part0#3", "part1#2", "part2#2"}
    jig = trimesh.creation.box((0.02, 0.02, 0.02))
    jig.export(tmp_path / "jig.stl")
    assert rasp.pack(blocks(2), rasp.box(*ROOM), "spectral", fixed=tmp_path / "jig.stl", **QUICK).fixed == ["jig"]


def test_of_what_is_fixed_no_gap_is_asked():
    there = [block("a", (0.02, 0.02, 0.02)), block("b", (0.02, 0.02, 0.02), (0.02, 0, 0))]
    packed = rasp.pack(
        [block("c", (0.03, 0.03, 0.03))], rasp.box(*ROOM), "spectral", fixed=there, clearance=0.002, **QUICK
    )
    assert packed.certificate.holds
    assert not measure(packed.bodies[:2] + there[1:], packed.matrices, packed.container, 0.002, 0.002).holds


def test_small_fixed_things_are_not_lost_in_what_is_tolerated_of_large_ones():
    """What is a millionth of the large part is a tenth of the pin."""

    def touching(bodies, container, time_limit):
        place = torch.tensor([[0.0001, 0, 0], [-0.06, 0, 0]], dtype=torch.float64)
        poses = Poses(torch.eye(3, dtype=torch.float64).expand(2, 3, 3), place)
        return finish(bodies, [0, 1], poses, container, Settings(**QUICK))

    pin = block("pin", (0.001, 0.001, 0.001), (0.0305, 0, 0))
    parts = [block("large", (0.06, 0.06, 0.06)), block("small", (0.01, 0.01, 0.01))]
    packed = pack_apart(touching, parts, rasp.box(0.2, 0.1, 0.1), None, [pin])
    assert [body.name for body in packed.bodies] == ["small", "pin"]
    assert packed.certificate.holds


@pytest.mark.parametrize("clearance", [None, 0.003])
def test_zones_stay_free(clearance):
    column = trimesh.creation.cylinder(0.02, 0.2, sections=24)
    zone = make_body("column", column.vertices, column.faces)
    packed = rasp.pack(blocks(9), rasp.box(*ROOM), "dense", keep_out=[zone], effort=6, clearance=clearance, **QUICK)
    assert packed.certificate.holds
    assert len(packed.bodies) >= 3
    solid = manifold3d.Manifold.cylinder(0.2, 0.02, circular_segments=24, center=True)
    assert solid.volume() == pytest.approx(zone.volume)
    for body, matrix in zip(packed.bodies, packed.matrices, strict=True):
        placed = placed_solid(body, matrix)
        assert (placed ^ placed_solid(zone, np.eye(4))).volume() <= 1e-4 * body.volume
        if clearance:
            assert placed.min_gap(placed_solid(zone, np.eye(4)), 1) >= clearance * (1 - 1e-9)
    left = np.prod(ROOM) - zone.volume * ROOM[2] / 0.2
    assert packed.density == pytest.approx(sum(body.volume for body in packed.bodies) / left)


def test_growing_is_part_of_the_time_limit(monkeypatch):
    clock = iter([100.0, 103.0, 200.0, 290.0])
    monkeypatch.setattr(around.time, "monotonic", lambda: next(clock))
    left = []

    def search(bodies, room, time_limit):
        left.append(time_limit)
        raise InputError("seen")

    bodies = blocks(2)
    for _ in range(2):
        with pytest.raises(InputError, match="seen"):
            pack_apart(search, bodies, rasp.box(0.2, 0.2, 0.2), Clearance(np.full(2, 0.002), 0.002), time_limit=10)
    assert left == [7.0, around.LEAST_SECONDS]


def test_names_of_new_parts_go_on_counting():
    there = unique_names([block("a", (1, 1, 1))] * 3)
    new = unique_names([block("a", (1, 1, 1)), block("b", (1, 1, 1)), block("a", (1, 1, 1))])
    assert [body.name for body in named_apart(new, there)] == ["a#4", "b", "a#5"]


@pytest.mark.parametrize(
    ("there", "told"),
    [
        ([block("a", (0.02,) * 3), block("b", (0.02,) * 3, (0.01, 0, 0))], "what is fixed must fit: a and b overlap"),
        ([block("a", (0.02,) * 3, (0.07, 0, 0))], "what is fixed must fit: a sticks out of the container"),
    ],
)
def test_what_is_fixed_must_fit(there, told):
    with pytest.raises(InputError, match=told):
        rasp.pack(blocks(2), rasp.box(*ROOM), "spectral", fixed=there)


def test_what_is_fixed_has_no_place_in_a_box_to_be_found():
    with pytest.raises(InputError, match="need"):
        rasp.pack(blocks(2), "auto", fixed=THERE)


@pytest.mark.parametrize("asked", [{}, {"clearance": 0.003}, {"clearance": 0.002, "wall_clearance": 0.004}])
@pytest.mark.parametrize("separable", [False, True])
def test_zones_stay_free_in_a_box_whose_height_is_found(asked, separable):
    """As high as four boxes beside a column: the column's foot is where the box's floor is."""
    zone = block("column", (0.03, 0.03, 1.0), (0.02, 0.01, 0.49))
    bodies = blocks(6)
    packed = rasp.pack(bodies, "auto:0.14,0.12,*", keep_out=[zone], effort=120, separable=separable, **asked)
    assert packed.certificate.holds
    assert len(packed.bodies) == len(bodies)
    assert packed.dismantling is None or packed.dismantling.holds
    height = packed.container.base.size[2]
    column = placed_solid(zone, np.eye(4)).translate((0, 0, -height / 2))
    solids = [placed_solid(body, matrix) for body, matrix in zip(packed.bodies, packed.matrices, strict=True)]
    for body, solid in zip(packed.bodies, solids, strict=True):
        assert (solid ^ column).volume() <= 1e-4 * body.volume
        wall = asked.get("wall_clearance", asked.get("clearance", 0))
        if wall:
            assert solid.min_gap(column, 1) >= wall * (1 - 1e-6)
    top = max(solid.bounding_box()[5] for solid in solids)
    assert height / 2 - top == pytest.approx(asked.get("wall_clearance", asked.get("clearance", 0)), abs=1e-4)
    left = height * 0.14 * 0.12 - 0.03 * 0.03 * height
    assert packed.density == pytest.approx(sum(body.volume for body in packed.bodies) / left)
