"""Packings named by files and numbers."""

import pytest

from rasp_core.packing import from_files
from rasp_core.util.errors import InputError

SMALL = {"iterations": 60, "resolution": 64, "query_points": 5000}


def test_load_repeats_and_scales(pool):
    bodies, room, scale = from_files.load(pool, "box:2,2,2", repeat=5, fit_objects=10, seed=3)
    assert len(bodies) == 5
    assert sum(body.volume for body in bodies) == pytest.approx(2.0)
    assert room.volume == pytest.approx(8)
    assert scale > 1


@pytest.mark.parametrize(
    ("method", "budget"), [("paper", {}), ("dense", {"effort": 3}), ("spectral", {}), ("dblf", {})]
)
def test_each_method_packs(pool, method, budget):
    facts = from_files.pack(pool, "box:0.15,0.15,0.15", method=method, seed=1, **budget, **SMALL)
    assert facts["certified"]
    assert 1 <= facts["objects"] <= 3
    assert 0 < facts["density"] < 1


def test_views_are_given_in_pairs(pool):
    _, room, _ = from_files.load(pool, "box:1,1,1", azimuths_deg=[0, 45], elevations_deg=[0, 30])
    assert room.views()[1].elevation_deg == 30
    with pytest.raises(InputError, match="--azimuths-deg"):
        from_files.load(pool, "box:1,1,1", azimuths_deg=[0, 45])
    with pytest.raises(InputError, match="--azimuths-deg"):
        from_files.load(pool, "auto", azimuths_deg=[0], elevations_deg=[0])


def test_a_box_to_be_found_has_no_size_that_objects_could_be_scaled_to(pool):
    with pytest.raises(InputError, match="--fit-objects"):
        from_files.load(pool, "auto", fit_objects=3)
