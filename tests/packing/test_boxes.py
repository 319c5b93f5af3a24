"""Several boxes: which of them hold what, with a search that tells all about its choice."""

from dataclasses import dataclass, replace
from itertools import chain

import pytest
import trimesh

from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.geometry.wishes import Wishes
from rasp_core.packing import boxes
from rasp_core.packing.boxes import Kind, fill_boxes, least_number
from rasp_core.util.errors import InputError


def cubes(*volumes):
    meshes = [trimesh.creation.box([volume ** (1 / 3)] * 3) for volume in volumes]
    return unique_names([make_body("cube", mesh.vertices, mesh.faces) for mesh in meshes])


@dataclass
class Certificate:
    holds: bool = True


@dataclass
class Found:
    chosen: list[int]
    certificate: Certificate
    interrupted: bool = False


def in_turn(bodies, kind=0, seconds=None, order=None, volumes=(1.0,)):
    """Takes what comes while the volume is not more than that of the box."""
    chosen, filled = [], 0.0
    for i in range(len(bodies)) if order is None else order:
        if filled + bodies[i].volume <= volumes[kind] + 1e-9:
            chosen.append(i)
            filled += bodies[i].volume
    if not chosen:
        raise InputError("not one of the objects could be placed")
    return Found(chosen, Certificate())


def by_size(bodies, kind=0, seconds=None):
    return in_turn(bodies, order=sorted(range(len(bodies)), key=lambda i: -bodies[i].volume))


def filled(bodies, search=in_turn, **options):
    found, _ = fill_boxes(in_turn, search, bodies, [Kind(1.0)], **options)
    assert all(len(box.packed.chosen) == len(box.indices) for box in found)
    return [sorted(box.indices) for box in found]


def test_all_go_in_box_after_box_each_once():
    found = filled(cubes(0.6, 0.6, 0.3, 0.5, 0.4, 0.1))
    assert sorted(chain(*found)) == list(range(6))
    assert found[0] == [0, 2, 5]


def test_the_last_box_is_given_up_where_the_others_can_take_it():
    """In turn: 0.3 0.3 | 0.7 | 0.7; by size 0.7 0.3 | 0.7 0.3."""
    bodies = cubes(0.3, 0.3, 0.7, 0.7)
    assert filled(bodies) == [[0, 1], [2], [3]]
    fuller = filled(bodies, by_size)
    assert [sum(bodies[i].volume for i in box) for box in fuller] == pytest.approx([1.0, 1.0])
    assert sorted(chain(*fuller)) == [0, 1, 2, 3]


def test_no_more_boxes_than_are_asked_for_and_these_fuller():
    bodies = cubes(0.6, 0.3, 0.6, 0.9)
    assert filled(bodies, most=2) == [[0, 1], [2]]
    assert filled(bodies, by_size, most=2) == [[0, 1], [3]]
    assert filled(bodies, most=5) == [[0, 1], [2], [3]]


def test_ranks_count_more_than_volume():
    bodies = cubes(0.9, 0.2, 0.9)
    bodies[1] = replace(bodies[1], wishes=Wishes(must=True))

    def musts_first(some, kind, seconds):
        return in_turn(some, order=sorted(range(len(some)), key=lambda i: not some[i].wishes.must))

    assert filled(bodies, by_size, most=1) == [[0]]
    assert filled(bodies, musts_first, most=1) == [[1]]


def test_what_fits_nowhere_is_left_over_but_not_if_it_is_all():
    assert filled(cubes(0.6, 1.5)) == [[0]]
    assert len(filled(cubes(0.3, 0.3, 0.7, 0.7, 1.5), by_size)) == 2, "the others are still brought closer"
    with pytest.raises(InputError, match="not one of the objects"):
        filled(cubes(1.5))


def test_what_does_not_hold_is_not_kept():
    def broken(bodies, kind, seconds):
        found = by_size(bodies)
        found.certificate = Certificate(False)
        return found

    assert filled(cubes(0.3, 0.3, 0.7, 0.7), broken) == [[0, 1], [2], [3]]


@pytest.mark.parametrize("raises", [False, True])
def test_ctrl_c_ends_the_search_and_the_boxes_are_kept(raises):
    """A search returns its best where Ctrl-C comes, or passes it on where it has none yet."""
    asked = []

    def stopped(bodies, kind, seconds):
        asked.append(len(bodies))
        if raises:
            raise KeyboardInterrupt
        return replace(in_turn(bodies), interrupted=True)

    found, interrupted = fill_boxes(in_turn, stopped, cubes(0.6, 0.6, 0.6), [Kind(1.0)])
    assert interrupted
    assert len(asked) == 1
    assert [box.indices for box in found] == [[0], [1], [2]]
    assert not fill_boxes(in_turn, in_turn, cubes(0.6, 0.6), [Kind(1.0)])[1]


def test_time_is_shared_by_the_boxes_that_are_to_come(monkeypatch):
    clock = [0.0]
    monkeypatch.setattr(boxes.time, "monotonic", lambda: clock[0])
    asked = []

    def slow(bodies, kind, seconds):
        asked.append(seconds)
        clock[0] += seconds
        return in_turn(bodies)

    filled(cubes(0.6, 0.6, 0.6), slow, time_limit=100.0)
    assert asked == [50.0, 50.0]
    asked.clear()
    filled(cubes(0.6, 0.6, 0.6), slow, time_limit=0.5)
    assert asked == []


def test_volumes_ask_for_so_many_at_least():
    assert least_number(cubes(0.5, 0.5), [Kind(1.0)]) == 1
    assert least_number(cubes(0.5, 0.6), [Kind(1.0)]) == 2
    assert least_number(cubes(0.1), [Kind(1.0)]) == 1
    assert least_number(cubes(0.5, 0.5), [Kind(0.4, 1), Kind(0.3)]) == 3
    assert least_number(cubes(0.5, 0.5), [Kind(0.4, 2), Kind(0.3)]) == 3
    assert least_number(cubes(0.5, 0.5), [Kind(0.4, 2)]) == 2, "there are no more"


def test_boxes_of_several_kinds_are_filled_in_their_order():
    """0.2, then 1.0, then 0.5 as often as is needed; what is too large for one waits for a later one."""

    def place(some, kind, seconds=None):
        return in_turn(some, kind, volumes=(0.2, 1.0, 0.5))

    def kinds(bodies, last=None):
        fits = [{i for i, body in enumerate(bodies) if body.volume <= volume} for volume in (0.2, 1.0, 0.5)]
        return [Kind(0.2, 1, fits[0]), Kind(1.0, 1, fits[1]), Kind(0.5, last, fits[2])]

    bodies = cubes(0.9, 0.15, 0.4, 0.4, 0.4)
    found, _ = fill_boxes(place, place, bodies, kinds(bodies))
    assert [(box.kind, box.indices) for box in found] == [(0, [1]), (1, [0]), (2, [2]), (2, [3]), (2, [4])]
    assert [box.kind for box in fill_boxes(place, place, bodies, kinds(bodies), most=2)[0]] == [0, 1]
    assert [box.kind for box in fill_boxes(place, place, bodies, kinds(bodies, last=2))[0]] == [0, 1, 2, 2]
    large = cubes(0.9, 0.4)
    found, _ = fill_boxes(place, place, large, kinds(large))
    assert [(box.kind, box.indices) for box in found] == [(1, [0]), (2, [1])], "a box too small for all is left out"
