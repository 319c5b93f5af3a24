"""Several boxes: which of them hold what, with a search that tells all about its choice."""

from dataclasses import dataclass
from itertools import chain

import pytest
import trimesh

from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.packing import boxes
from rasp_core.packing.boxes import fill_boxes, least_number
from rasp_core.util.errors import InputError


def cubes(*volumes):
    meshes = [trimesh.creation.box([volume ** (1 / 3)] * 3) for volume in volumes]
    return unique_names([make_body("cube", mesh.vertices, mesh.faces) for mesh in meshes])


class Certificate:
    holds = True


@dataclass
class Found:
    chosen: list[int]
    certificate: Certificate


class InTurn:
    """Takes what comes while the volume is not more than `room`; keeps what it was asked."""

    def __init__(self, room=1.0, best=False):
        self.room, self.best, self.asked = room, best, []

    def __call__(self, bodies, seconds):
        self.asked.append((len(bodies), seconds))
        order = range(len(bodies))
        if self.best and len(self.asked) > self.best:
            order = sorted(order, key=lambda i: -bodies[i].volume)
        chosen, filled = [], 0.0
        for i in order:
            if filled + bodies[i].volume <= self.room * (1 + 1e-9):
                chosen.append(i)
                filled += bodies[i].volume
        if not chosen:
            raise InputError("not one of the objects could be placed")
        return Found(chosen, Certificate())


def held(found):
    return [sorted(indices) for _, indices in found]


def test_all_go_in_box_after_box_each_once():
    found = fill_boxes(InTurn(), cubes(0.6, 0.6, 0.3, 0.5, 0.4, 0.1), 1.0)
    assert sorted(chain(*held(found))) == list(range(6))
    assert held(found)[0] == [0, 2, 5]
    assert all(len(packed.chosen) == len(indices) for packed, indices in found)


def test_the_last_box_is_given_up_where_the_others_can_take_it():
    """In turn: 0.3 0.3 | 0.7 | 0.7: by size 0.7 0.3 | 0.7 0.3."""
    bodies = cubes(0.3, 0.3, 0.7, 0.7)
    assert held(fill_boxes(InTurn(), bodies, 1.0)) == [[0, 1], [2], [3]]
    fuller = fill_boxes(InTurn(best=3), bodies, 1.0)
    assert [sum(bodies[i].volume for i in box) for box in held(fuller)] == pytest.approx([1.0, 1.0])
    assert sorted(chain(*held(fuller))) == [0, 1, 2, 3]


def test_no_more_boxes_than_are_asked_for():
    bodies = cubes(0.6, 0.6, 0.6)
    assert held(fill_boxes(InTurn(), bodies, 1.0, most=2)) == [[0], [1]]
    assert held(fill_boxes(InTurn(), bodies, 1.0, most=5)) == [[0], [1], [2]]


def test_what_fits_nowhere_is_left_over_but_not_if_it_is_all():
    assert held(fill_boxes(InTurn(), cubes(0.6, 1.5), 1.0)) == [[0]]
    with pytest.raises(InputError, match="not one of the objects"):
        fill_boxes(InTurn(), cubes(1.5), 1.0)


def test_time_is_shared_by_the_boxes_that_are_to_come(monkeypatch):
    monkeypatch.setattr(boxes.time, "monotonic", lambda: 0.0)
    search = InTurn()
    fill_boxes(search, cubes(0.6, 0.6, 0.6, 0.6), 1.0, time_limit=100.0, most=4)
    first = 100 * boxes.FILLING / 4  # 2.4 boxes' volume at half of their volume, but four boxes at most
    assert search.asked[0] == (4, pytest.approx(first))
    assert all(seconds >= first for _, seconds in search.asked[:4])
    untimed = InTurn()
    fill_boxes(untimed, cubes(0.6), 1.0)
    assert untimed.asked == [(1, None)]


def test_volumes_ask_for_so_many_at_least():
    assert least_number(cubes(0.5, 0.5), 1.0) == 1
    assert least_number(cubes(0.5, 0.6), 1.0) == 2
    assert least_number(cubes(0.1), 1.0) == 1
