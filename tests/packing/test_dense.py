"""The dense search: certified at any time, denser than what it starts from, the same for the same effort."""

import numpy as np
import pytest

from data_fetch import kitchen_like, torus
from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import Container, box
from rasp_core.packing import constructive, dense, growth
from rasp_core.problem import Settings
from rasp_core.util.errors import InputError

ROOM = box((0.22, 0.2, 0.2))
QUICK = Settings(query_points=10_000, resolution=64)


@pytest.fixture(scope="module")
def pool():
    return kitchen_like(24)


@pytest.fixture(scope="module")
def packed(pool):
    return dense.pack(pool, ROOM, QUICK, effort=15)


def test_it_is_certified_and_denser_than_its_start(pool, packed):
    bodies = packed.bodies
    assert certify(bodies, packed.matrices, ROOM).holds
    assert bodies == [pool[i] for i in packed.chosen]
    assert len(set(packed.chosen)) == len(packed.chosen)
    densities = [r["density"] for r in packed.rounds]
    assert densities == sorted(densities)
    assert packed.density == pytest.approx(densities[-1])
    assert packed.density > constructive.pack(pool, ROOM, QUICK).density
    assert packed.history.shape[1] == 5


def test_the_same_effort_gives_the_same_packing(pool):
    first, again = (dense.pack(pool[:12], box((0.15, 0.15, 0.15)), QUICK, effort=5) for _ in range(2))
    assert again.chosen == first.chosen
    assert np.array_equal(again.matrices, first.matrices)


def test_a_container_with_a_hole():
    found = dense.pack(kitchen_like(12), Container(torus(0.15, 0.06)), QUICK, effort=6)
    assert found.certificate.holds
    assert len(found.chosen) >= 2


def test_time_ends_a_search_with_what_holds(pool):
    found = dense.pack(pool, ROOM, QUICK, time_limit=8)
    assert found.certificate.holds
    assert found.chosen


def test_ctrl_c_returns_the_best_so_far(pool, monkeypatch):
    tries = []

    def interrupt(self, *proposal):
        tries.append(proposal)
        if len(tries) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(growth.Growth, "_separate", interrupt)
    found = dense.pack(pool, ROOM, QUICK, effort=50)
    assert found.arrangement.interrupted
    assert found.certificate.holds
    assert len(tries) == 2


def test_a_pool_that_fits_whole_is_packed_whole():
    few = kitchen_like(3)
    assert sorted(dense.pack(few, box((0.4, 0.4, 0.4)), QUICK, effort=5).chosen) == [0, 1, 2]


def test_nothing_is_made_ready_to_be_pressed_where_all_is_placed(monkeypatch):
    """Grids of a thousand different parts take a minute."""
    monkeypatch.setattr(dense, "Separation", lambda *_: pytest.fail("it is not needed"))
    assert len(dense.pack(kitchen_like(3), box((0.4, 0.4, 0.4)), QUICK, effort=5).chosen) == 3


def test_bad_input_is_refused(pool):
    with pytest.raises(InputError, match="effort"):
        dense.pack(pool, ROOM, effort=-1)


def test_no_time_at_all_says_that_nothing_was_placed(pool):
    with pytest.raises(InputError, match="not one of the objects"):
        dense.pack(pool, ROOM, QUICK, time_limit=1e-6)
