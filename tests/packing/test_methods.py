"""Every method packs what it is given as it is wished, and refuses what it would ignore."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

import rasp_core as rasp
from data_fetch import kitchen_like
from rasp_core.geometry.containers import FreeBox, box
from rasp_core.geometry.items import Item
from rasp_core.packing import from_files, methods
from rasp_core.problem import Settings
from rasp_core.util.errors import InputError
from tests import judge

SMALL = {"iterations": 60, "resolution": 64, "query_points": 5000}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"method": "magic"}, "magic.*paper, dense, spectral, dblf, heightmap"),
        ({"method": "rasp"}, "rasp.*paper, dense"),
        ({"method": "dense", "count": 2}, r"does not use count \(--count\); leave it out, or use --method paper$"),
        (
            {"method": "spectral", "effort": 2},
            r"effort \(--effort\); leave it out, or use --method dense$",
        ),
    ],
)
def test_what_a_method_does_not_know_is_refused(pool, arguments, message):
    bodies, room, _ = from_files.load(pool, "box:0.2,0.2,0.2")
    with pytest.raises(InputError, match=message):
        methods.search(arguments.pop("method"), bodies, room, **arguments)


@pytest.mark.parametrize("method", methods.METHODS)
def test_nothing_and_what_is_too_large_are_refused_before_any_search(method):
    with pytest.raises(InputError, match="there is nothing to pack"):
        methods.search(method, [], box((0.2, 0.2, 0.2)))
    with pytest.raises(InputError, match="mm is larger than the container, 20 x 20 x 20 mm"):
        methods.search(method, kitchen_like(3), box((0.02, 0.02, 0.02)), unit="mm")
    if method != "paper":
        with pytest.raises(InputError, match="larger than the container"):
            methods.search(method, kitchen_like(2), FreeBox((0.01, 0.01, None)))


@pytest.mark.parametrize(
    ("method", "given", "message"),
    [
        ("dense", {"lambda_": 1.0}, r"dense does not use lambda \(--lambda\); leave it out, or use --method paper$"),
        ("dense", {"epsilon": 0.1, "iterations": 9}, r"epsilon \(--epsilon\) and iterations \(.*; leave them out, or"),
        ("dblf", {"query_points": 9}, "dblf does not use query_points; leave it out, or use --method paper$"),
        ("paper", {"effort": 3}, "paper does not use effort .*use --method dense$"),
        ("spectral", {"effort": 3, "count": 2}, "leave them out$"),
        ("paper", {"learning_rate": 0.1}, r"learning_rate; leave it out, or give a count \(--count\)$"),
    ],
)
def test_a_setting_that_would_be_ignored_is_refused(method, given, message):
    with pytest.raises(InputError, match=message):
        methods.refuse_ignored(method, given)


def test_settings_that_a_method_reads_are_not_refused():
    methods.refuse_ignored("paper", {"count": 3, "learning_rate": 0.1, "lambda_": 1.0, "time_limit": 9.0})
    methods.refuse_ignored("dense", {"effort": 3, "query_points": 9, "resolution": 64, "seed": 1, "out": "x"})
    methods.refuse_ignored("spectral", {"effort": 3}, FreeBox((None, None, None)))
    with pytest.raises(InputError, match=r"does not use query_points; leave it out$"):
        methods.refuse_ignored("dense", {"query_points": 3}, FreeBox((None, None, None)))


OTHER = {"lambda_": 0.5, "epsilon": 0.03, "iterations": 30, "query_points": 3000, "jitter": False, "resolution": 32}


@pytest.mark.parametrize(("method", "effort"), [("dense", 3), ("spectral", None)])
def test_what_the_table_leaves_out_changes_nothing(method, effort):
    """Any setting that a method is said to ignore gives the same packing whatever its value."""
    bodies, room = kitchen_like(6), box((0.13, 0.13, 0.13))
    usual = Settings(**SMALL)
    ignored = {name: value for name, value in OTHER.items() if name not in methods.USES[method]}
    assert len(ignored) >= 3
    one, other = (
        methods.search(method, bodies, room, settings=settings, effort=effort)
        for settings in (usual, replace(usual, **ignored))
    )
    assert one.chosen == other.chosen
    assert np.array_equal(one.matrices, other.matrices)


def test_a_box_to_be_found_is_for_methods_that_can_find_one(pool):
    facts = from_files.pack(pool, "auto", effort=2, **SMALL)
    assert facts["certified"]
    assert facts["objects"] == 3
    bodies, shape, _ = from_files.load(pool, "auto:cube")
    assert methods.resolve_method(None, shape) == "dense"
    with pytest.raises(InputError, match="paper packs into a given container"):
        methods.search("paper", bodies, shape)


SHAPES = {"brick": (0.06, 0.035, 0.02), "bar": (0.08, 0.015, 0.02), "cube": (0.025, 0.025, 0.025)}


@pytest.fixture
def wished(tmp_path):
    """Sixteen blocks, of which the bricks must go in and lie flat, the bars stay upright as in their file, and the
    cubes, the rest, may only be turned about the vertical."""
    for name, edges in SHAPES.items():
        trimesh.creation.box(edges).export(tmp_path / f"{name}.stl")
    return [
        Item(tmp_path / "cube.stl", 8, turns="z"),
        Item(tmp_path / "bar.stl", 5, priority=2, turns="none"),
        Item(tmp_path / "brick.stl", 3, must=True, turns="flat:2"),
    ]


@pytest.mark.parametrize(
    ("method", "budget"),
    [
        ("paper", {"iterations": 30, "resolution": 32, "query_points": 2000}),
        ("dense", {"effort": 10, "query_points": 2000}),
        ("spectral", {}),
        ("dblf", {}),
        ("heightmap", {}),
    ],
)
def test_every_method_keeps_turns_and_puts_in_what_must(wished, tmp_path, method, budget):
    packed = rasp.pack(wished, rasp.box(0.11, 0.1, 0.07), method, clearance=0.002, **budget)
    assert packed.missing == [] or method == "paper", "which tries little in so few iterations"
    seen = judge.read(packed.save(tmp_path / "out") / "scene.glb")
    counts = judge.counts(seen)
    assert counts["brick"] + len(packed.missing) == 3
    assert counts["bar"] + counts["cube"] == len(packed.bodies) - counts["brick"]
    assert judge.least_gap(seen) >= 0.002 - 1e-8
    assert judge.least_to_box(seen, (0.11, 0.1, 0.07)) >= 0.002 - 1e-8
    asked = {"brick": "flat:2", "bar": "none", "cube": "z"}
    for name, (_, rotation) in seen.items():
        assert judge.off_by(asked[name.split("#")[0]], rotation, [[0, 0, 1], [0, 0, -1]]) < 1e-9, name


@pytest.mark.parametrize(("method", "budget"), [("spectral", {}), ("dense", {"effort": 60})])
def test_the_smallest_box_keeps_turns(wished, method, budget):
    packed = rasp.pack(wished, "auto", method, **budget)
    assert packed.certificate.holds
    assert len(packed.bodies) == packed.pool
    for body, matrix in zip(packed.bodies, packed.matrices, strict=True):
        assert judge.off_by(body.wishes.turns.word, matrix[:3, :3], [[0, 0, 1], [0, 0, -1]]) < 1e-9


@pytest.mark.parametrize("method", ["spectral", "dense", "paper"])
def test_what_has_priority_goes_in_first_though_it_is_smaller(tmp_path, method):
    large, small = (trimesh.creation.box([edge] * 3) for edge in (0.09, 0.03))
    large.export(tmp_path / "large.stl")
    small.export(tmp_path / "small.stl")
    items = [Item(tmp_path / "large.stl"), Item(tmp_path / "small.stl", priority=1)]
    budget = {"dense": {"effort": 5}, "paper": {"iterations": 20}}.get(method, {})
    assert [body.name for body in rasp.pack(items, rasp.box(0.1, 0.1, 0.1), method, **budget).bodies] == ["small"]
    assert [body.name for body in rasp.pack(str(tmp_path), rasp.box(0.1, 0.1, 0.1), "spectral").bodies] == ["large"]


def test_what_must_go_in_and_does_not_is_named(tmp_path):
    trimesh.creation.box([0.06] * 3).export(tmp_path / "cube.stl")
    packed = rasp.pack([Item(tmp_path / "cube.stl", 3, must=True)], rasp.box(0.13, 0.1, 0.1), "spectral")
    assert len(packed.bodies) == 2
    assert packed.missing == ["cube#3"]
    assert packed.record()["missing"] == ["cube#3"]
