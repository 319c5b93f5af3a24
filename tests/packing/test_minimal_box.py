"""The smallest box holds all, certified, never grows, and keeps its shape."""

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from data_fetch import kitchen_like
from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import FreeBox, parse
from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.packing import minimal_box
from rasp_core.packing.methods import search
from rasp_core.packing.shrinking import FALLING
from rasp_core.problem import Settings
from rasp_core.util.budget import Budget
from rasp_core.util.errors import InputError

QUICK = Settings(query_points=10_000, resolution=64)


def holds_all(packed, bodies):
    assert packed.chosen == list(range(len(bodies)))
    assert certify(bodies, packed.matrices, packed.container).holds
    assert packed.certificate.holds
    densities = [r["density"] for r in packed.rounds]
    assert densities == sorted(densities)
    assert packed.density == pytest.approx(densities[-1])
    return packed.container.size


def placed(bodies, shape, rule=None, effort=0):
    """A search that has its first box."""
    search = minimal_box._Search(bodies, shape, QUICK, "cpu", Budget(effort=effort), False, rule)
    search.place()
    return search


@pytest.mark.parametrize("text", ["auto", "auto:cube", "auto:0.2,0.16,*"])
def test_all_objects_lie_in_a_box_of_the_shape(text):
    bodies = kitchen_like(10)
    edges = holds_all(packed := minimal_box.pack(bodies, parse(text), QUICK, effort=10), bodies)
    if text == "auto:cube":
        assert np.ptp(edges) == 0
    if text == "auto:0.2,0.16,*":
        assert edges[:2].tolist() == [0.2, 0.16]
    assert len(packed.rounds) > 1, "ten tries made it smaller"


def test_the_same_effort_gives_the_same_box():
    bodies = kitchen_like(5)
    first, again = (minimal_box.pack(bodies, parse("auto"), QUICK, effort=4) for _ in range(2))
    assert np.array_equal(first.matrices, again.matrices)


@pytest.mark.parametrize("rule", ["dblf", "heightmap"])
def test_a_baseline_alone(rule):
    bodies = kitchen_like(8)
    packed = minimal_box.pack(bodies, parse("auto"), QUICK, effort=3, rule=rule)
    holds_all(packed, bodies)
    assert len(packed.history) == 0


def test_eight_cubes_are_a_cube():
    cube = trimesh.creation.box((0.1, 0.1, 0.1))
    bodies = unique_names([make_body("cube", cube.vertices, cube.faces)] * 8)
    assert holds_all(minimal_box.pack(bodies, parse("auto:cube"), QUICK, effort=0), bodies) == pytest.approx([0.2] * 3)


@pytest.mark.parametrize("text", ["auto", "auto:cube", "auto:*,0.3,*"])
def test_one_object_is_boxed(text):
    (body,) = kitchen_like(1)
    edges = holds_all(minimal_box.pack([body], parse(text), QUICK, effort=1), [body])
    assert edges.max() <= (0.3 if "0.3" in text else 2 * body.half_extents.max() + 1e-9)


def test_many_bodies_are_pressed_alone(monkeypatch):
    made = []
    monkeypatch.setattr(minimal_box, "MOST_BODIES", 3)
    monkeypatch.setattr("rasp_core.packing.voxel_descent.VoxelDescent.begin", lambda *_: made.append(1))
    bodies = kitchen_like(4)
    holds_all(minimal_box.pack(bodies, parse("auto"), QUICK, effort=12), bodies)
    assert made == []


def test_a_means_that_has_its_turn_begins_from_the_best():
    search, begun = placed(kitchen_like(4), parse("auto"), effort=10), []
    for means in (search.shrinking, search.pressing):
        means.begin = lambda means=means: begun.append(means)
        means.improve = means.end = lambda late: None
    for _ in range(2):
        search.improve()
    assert begun == [search.shrinking], "boxes of voxels still fall"
    search.shrinking.waited = FALLING
    for _ in range(4):
        search.improve()
    assert begun[:4] == [search.shrinking, search.pressing, search.shrinking, search.pressing], "none gains"


def test_what_is_to_come_apart_is_not_pressed():
    search = minimal_box._Search(kitchen_like(4), parse("auto"), QUICK, "cpu", Budget(effort=10), False, None, True)
    assert list(search.turns.gains) == ["shrinking"]
    search.place()
    assert search.shrinking.descent.search.separable


def test_ctrl_c_returns_the_best_so_far(monkeypatch):
    def interrupt(self):
        raise KeyboardInterrupt

    monkeypatch.setattr(minimal_box._Search, "improve", interrupt)
    packed = minimal_box.pack(kitchen_like(4), parse("auto"), QUICK, effort=50)
    assert packed.arrangement.interrupted
    assert packed.certificate.holds
    monkeypatch.setattr(minimal_box._Search, "place", interrupt)
    with pytest.raises(KeyboardInterrupt):
        minimal_box.pack(kitchen_like(4), parse("auto"), QUICK, effort=5)


def test_time_ends_a_search():
    packed = minimal_box.pack(kitchen_like(4), parse("auto"), QUICK, time_limit=1e-6)
    assert packed.certificate.holds


def test_a_first_placement_that_cannot_be_made_to_hold_is_an_error(monkeypatch):
    monkeypatch.setattr("rasp_core.packing.best_box.certify", lambda *_: SimpleNamespace(holds=False))
    with pytest.raises(InputError, match="not all objects fit between the fixed edges"):
        minimal_box.pack(kitchen_like(2), parse("auto:0.2,0.2,*"), QUICK, effort=1)


def test_parts_that_fill_the_fixed_edges_with_their_clearance_are_boxed():
    """Two blocks and three gaps are as long as the box, to a thousandth of a voxel."""
    block = trimesh.creation.box((0.05, 0.05, 0.05))
    bodies = unique_names([make_body("block", block.vertices, block.faces)] * 2)
    found = search("dense", bodies, parse("auto:0.1061,0.0541,*"), effort=2, clearance=0.002)
    assert found.certificate.holds
    assert len(found.chosen) == 2


def test_bad_input_is_refused():
    with pytest.raises(InputError, match="effort"):
        minimal_box.pack(kitchen_like(2), parse("auto"), effort=-1)


def test_a_clearance_much_larger_than_the_parts_takes_no_longer():
    """What is placed is as large as what is kept clear about it."""
    pearl, bead = trimesh.creation.icosphere(radius=0.002), trimesh.creation.box((0.002, 0.002, 0.002))
    bodies = [make_body(name, mesh.vertices, mesh.faces) for name, mesh in (("pearl", pearl), ("bead", bead))]
    found = search("dense", bodies, parse("auto:0.1,0.1,*"), effort=2, clearance=0.02)
    assert found.certificate.holds
    assert found.certificate.gaps.least.gap >= 0.02
    assert found.arrangement.problem.container.size.max() < 0.15


def test_fixed_edges_that_do_not_hold_an_object_are_refused():
    plate = trimesh.creation.box((0.1, 0.1, 0.01))
    with pytest.raises(InputError, match="between the fixed edges"):
        minimal_box.pack(
            [make_body("plate", plate.vertices, plate.faces)], FreeBox((0.05, 0.05, None)), QUICK, effort=0
        )


def test_cubes_leave_nothing_between_them():
    """Seven trominoes and three cubes: 24 cells, which fill 2 x 3 x 4 or do so nearly."""
    bar = trimesh.creation.box((0.05, 0.05, 0.15))
    corner = trimesh.util.concatenate(
        [
            trimesh.creation.box((0.05, 0.05, 0.05)).apply_translation((0.05 * x, 0.05 * y, 0))
            for x, y in ((0, 0), (1, 0), (0, 1))
        ]
    )
    cube = trimesh.creation.box((0.05, 0.05, 0.05))
    pieces = [("bar", bar)] * 3 + [("corner", corner)] * 4 + [("cube", cube)] * 3
    bodies = unique_names([make_body(name, mesh.vertices, mesh.faces) for name, mesh in pieces])
    packed = minimal_box.pack(bodies, parse("auto"), QUICK, effort=2)
    edges = holds_all(packed, bodies)
    assert packed.density > 0.8, edges


@pytest.mark.parametrize("wider", [1.007, 1.011])
def test_what_fits_among_other_voxels_alone_is_placed(wider):
    """A base hardly wider than the widest object: at first by finer ones, then by a whole number of them."""
    bodies = kitchen_like(5)
    wide = wider * max(2 * np.sort(body.half_extents)[1] for body in bodies)
    search, fine = (placed(bodies, FreeBox((wide, wide, None)), rule) for rule in (None, "spectral"))
    assert search.placement.room.voxel == pytest.approx(fine.placement.room.voxel)
    assert search.best.edges == pytest.approx(fine.best.edges)


def test_the_first_placement_is_among_coarser_voxels_for_the_search_alone():
    search, baseline = (placed(kitchen_like(6), parse("auto"), rule) for rule in (None, "spectral"))
    assert search.placement.room.voxel == pytest.approx(2 * baseline.placement.room.voxel)
