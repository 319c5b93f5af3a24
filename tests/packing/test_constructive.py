"""Baselines are certified, and rebuilding does not spoil a placement."""

from itertools import count

import pytest

from data_fetch import kitchen_like, polycubes, torus
from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import Container, box
from rasp_core.packing import constructive
from rasp_core.packing.pool import draw
from rasp_core.packing.result import finish
from rasp_core.problem import Settings
from rasp_core.util import budget
from rasp_core.util.errors import InputError

ROOM = box((0.22, 0.2, 0.2))
QUICK = Settings(resolution=64)


@pytest.mark.parametrize("rule", constructive.RULES)
@pytest.mark.parametrize("container", [ROOM, Container(torus(0.15, 0.06))])
def test_a_placement_is_certified(container, rule):
    pool = kitchen_like(12)
    packed = constructive.pack(pool, container, QUICK, rule=rule)
    assert packed.certificate.holds
    assert certify(packed.bodies, packed.matrices, container).holds
    assert len(set(packed.chosen)) == len(packed.chosen) >= 2
    assert packed.bodies == [pool[i] for i in packed.chosen]
    assert constructive.pack(pool, container, QUICK, rule=rule).chosen == packed.chosen


@pytest.mark.parametrize("rule", constructive.RULES)
def test_cubes_of_one_size_fill_their_box(rule):
    """Eight cubes in a box of two by two by two."""
    cube = next(body for body in polycubes() if body.volume == min(b.volume for b in polycubes()))
    edge = 2 * cube.half_extents[0]
    packed = constructive.pack(draw([cube], 12, 0), box([2 * edge] * 3), QUICK, rule=rule)
    assert len(packed.chosen) == 8
    assert packed.certificate.holds


def test_rebuilding_keeps_a_placement_whole():
    placement = constructive.Placement(draw(polycubes(), 60, 0), box((0.3, 0.3, 0.3)), seed=1)
    placement.fill()
    first = best = placement.density
    for _ in range(40):
        placement.rebuild()
        best = max(best, placement.density)
    chosen = list(placement.placed)
    packed = finish(placement.pool, chosen, placement.poses, placement.container, QUICK)
    assert packed.certificate.holds
    assert packed.density == pytest.approx(placement.density)
    assert best >= first


def test_more_time_is_used_for_more_placements(monkeypatch):
    """Each look at the clock takes a second; a placement looks once for each object."""
    clock = count()
    monkeypatch.setattr(budget.time, "monotonic", lambda: next(clock))
    packed = constructive.pack(kitchen_like(8), ROOM, QUICK, time_limit=30)
    assert len(packed.rounds) > 2
    assert packed.density == pytest.approx(max(r["density"] for r in packed.rounds))


def test_more_sequences_are_tried():
    packed = constructive.pack(kitchen_like(8), ROOM, QUICK, rule="dblf", sequences=3)
    assert len(packed.rounds) == 3
    assert packed.density == pytest.approx(max(r["density"] for r in packed.rounds))


def test_bad_input_is_refused():
    with pytest.raises(InputError, match=r"rule 'magic'.*spectral, dblf, heightmap"):
        constructive.pack(kitchen_like(3), ROOM, rule="magic")
    with pytest.raises(InputError, match="not one of the objects could be placed"):
        constructive.pack(kitchen_like(3), box((0.02, 0.02, 0.02)))
