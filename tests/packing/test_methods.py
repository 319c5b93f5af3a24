"""Packings named by files and numbers."""

import pytest

from rasp_core.packing import methods
from rasp_core.util.errors import InputError

SMALL = {"iterations": 60, "resolution": 64, "query_points": 5000}


def test_load_repeats_and_scales(pool):
    bodies, room, scale = methods.load(pool, "box:2,2,2", repeat=5, fit_objects=10, seed=3)
    assert len(bodies) == 5
    assert sum(body.volume for body in bodies) == pytest.approx(2.0)
    assert room.volume == pytest.approx(8)
    assert scale > 1


@pytest.mark.parametrize(("method", "budget"), [("rasp", {}), ("dense", {"effort": 3}), ("spectral", {}), ("dblf", {})])
def test_each_method_packs(pool, method, budget):
    facts = methods.pack(pool, "box:0.15,0.15,0.15", method=method, seed=1, **budget, **SMALL)
    assert facts["certified"]
    assert 1 <= facts["objects"] <= 3
    assert 0 < facts["density"] < 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"method": "magic"}, "magic.*rasp, dense, spectral, dblf, heightmap"),
        ({"method": "dense", "count": 2}, "--count"),
        ({"method": "spectral", "effort": 2}, "--effort|no effort"),
    ],
)
def test_what_a_method_does_not_know_is_refused(pool, arguments, message):
    bodies, room, _ = methods.load(pool, "box:0.2,0.2,0.2")
    with pytest.raises(InputError, match=message):
        methods.search(arguments.pop("method"), bodies, room, **arguments)


def test_a_box_to_be_found_is_for_methods_that_can_find_one(pool):
    facts = methods.pack(pool, "auto", effort=2, **SMALL)
    assert facts["certified"]
    assert facts["objects"] == 3
    bodies, shape, _ = methods.load(pool, "auto:cube")
    assert methods.resolve_method(None, shape) == "dense"
    with pytest.raises(InputError, match="rasp packs into a given container"):
        methods.search("rasp", bodies, shape)
    with pytest.raises(InputError, match="--fit-objects"):
        methods.load(pool, "auto", fit_objects=3)


def test_views_are_given_in_pairs(pool):
    _, room, _ = methods.load(pool, "box:1,1,1", azimuths_deg=[0, 45], elevations_deg=[0, 30])
    assert room.views()[1].elevation_deg == 30
    with pytest.raises(InputError, match="--azimuths-deg"):
        methods.load(pool, "box:1,1,1", azimuths_deg=[0, 45])
    with pytest.raises(InputError, match="--azimuths-deg"):
        methods.load(pool, "auto", azimuths_deg=[0], elevations_deg=[0])
