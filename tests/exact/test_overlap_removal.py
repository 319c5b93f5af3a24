"""Slopes against finite differences of the booleans; what overlaps by a hair is parted, what overlaps much is not."""

import numpy as np
import pytest
import torch
import trimesh

from data_fetch import kitchen_like
from rasp_core import poses
from rasp_core.exact import overlap_removal
from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import box
from rasp_core.geometry.meshes import make_body
from rasp_core.poses import Poses, file_to_world


def block(name, *edges):
    mesh = trimesh.creation.box(edges)
    return make_body(name, mesh.vertices, mesh.faces)


def start(*centres):
    turn = poses.angles_to_rotation(torch.tensor([[0.2, 0.1, 0.3], [0.0, 0.0, 0.0], [0.1, 0.4, 0.0]]).double())
    return Poses(turn[: len(centres)], torch.tensor(centres, dtype=torch.float64))


def test_slopes_are_those_of_the_volume():
    bodies, there = kitchen_like(2), start((0, 0, 0), (0.02, 0.01, 0.005))
    faults = overlap_removal._Faults(bodies, box((9, 9, 9)), np.ones(2, bool))
    (fault,) = faults.at(there)
    assert fault.movers == (0, 1)
    assert fault.fraction == pytest.approx(fault.volume / min(body.volume for body in bodies))
    force, moment = overlap_removal._slope(fault.solid, faults.solids[1], there.translation[1].numpy())

    def shared(shift, turn):
        moved = Poses(
            torch.cat(
                [there.rotation[:1], poses.angles_to_rotation(torch.tensor([turn]).double()) @ there.rotation[1:]]
            ),
            there.translation + torch.tensor([[0.0, 0, 0], shift]).double(),
        )
        return faults.at(moved)[0].volume

    for axis in np.eye(3) * 1e-6:
        still = [0.0, 0.0, 0.0]
        assert (shared(list(axis), still) - shared(list(-axis), still)) / 2e-6 == pytest.approx(
            force @ axis / 1e-6, rel=1e-3, abs=1e-9
        )
        turned = [1e2 * a for a in axis]
        back = [-a for a in turned]
        assert (shared(still, turned) - shared(still, back)) / 2e-4 == pytest.approx(
            moment @ axis / 1e-6, rel=1e-2, abs=1e-10
        )


def test_thin_overlaps_and_protrusions_are_taken_away():
    bodies = [block(name, 0.1, 0.1, 0.1) for name in "abc"]
    room = box((0.5, 0.5, 0.1002))
    there = Poses(torch.eye(3).double().repeat(3, 1, 1), torch.tensor([[0, 0, 2e-4], [0.0998, 0, 0], [0.1, 0.0997, 0]]))
    assert not certify(bodies, file_to_world(bodies, there.rotation, there.translation), room).holds
    repaired = overlap_removal.remove_overlaps(bodies, there, room)
    assert certify(bodies, file_to_world(bodies, repaired.rotation, repaired.translation), room).holds
    assert (repaired.translation - there.translation).abs().max() < 1e-3, "a small move will do"


def test_only_the_movers_move():
    bodies = [block(name, 0.1, 0.1, 0.1) for name in "abc"]
    there = Poses(torch.eye(3).double().repeat(3, 1, 1), torch.tensor([[0, 0, 0], [0.0998, 0, 0], [0.0998, 0.0998, 0]]))
    repaired = overlap_removal.remove_overlaps(bodies, there, box((0.5, 0.5, 0.2)), movers=[1])
    assert (repaired.translation != there.translation).any(1).tolist() == [False, True, False]
    far = Poses(there.rotation, torch.tensor([[0, 0, 0], [0.0, 0.05, 0], [0.2, 0, 0]]))
    same = overlap_removal.remove_overlaps(bodies, far, box((0.5, 0.5, 0.2)), movers=[2])
    assert torch.equal(same.translation, far.translation.double()), "what others share is taken as it is"


def test_large_faults_are_not_tried():
    bodies = [block(name, 0.1, 0.1, 0.1) for name in "ab"]
    there = Poses(torch.eye(3).double().repeat(2, 1, 1), torch.tensor([[-0.049, 0.0, 0.0], [0.049, 0, 0]]))
    assert overlap_removal.remove_overlaps(bodies, there, box((0.5, 0.1, 0.1)), largest=0.01) is None
    assert overlap_removal.remove_overlaps(bodies, there, box((0.5, 0.1, 0.1)), largest=0.03) is not None


def test_what_has_no_room_is_given_up():
    bodies = [block(name, 0.1, 0.1, 0.1) for name in "ab"]
    there = Poses(torch.eye(3).double().repeat(2, 1, 1), torch.tensor([[-0.045, 0.0, 0.0], [0.045, 0, 0]]))
    assert overlap_removal.remove_overlaps(bodies, there, box((0.19, 0.1, 0.1))) is None


def test_only_what_moved_is_tested_again(monkeypatch):
    bodies = [block(name, 0.1, 0.1, 0.1) for name in "abc"]
    there = Poses(
        torch.eye(3).double().repeat(3, 1, 1), torch.tensor([[0, 0, 0], [0.09, 0, 0], [0.18, 0, 0.0]]).double()
    )
    faults, noted = overlap_removal._Faults(bodies, box((0.6, 0.4, 0.1)), np.ones(3, bool)), []
    note = overlap_removal._Faults._note
    monkeypatch.setattr(
        overlap_removal._Faults, "_note", lambda self, who, what: (noted.append(who), note(self, who, what))
    )
    first = {fault.movers: fault.volume for fault in faults.at(there)}
    assert first == {(0, 1): pytest.approx(1e-4), (1, 2): pytest.approx(1e-4)}
    noted.clear()
    assert {fault.movers: fault.volume for fault in faults.at(there)} == first
    assert not noted
    there.translation[2, 0] = 0.2
    assert [fault.movers for fault in faults.at(there)] == [(0, 1)]
    assert all(2 in who for who in noted)


def test_what_cannot_be_parted_is_held_without_what_is_most_at_fault():
    bodies, room = [block(name, 0.1, 0.1, 0.1) for name in "abc"], box((0.2001, 0.1001, 0.1001))
    places = torch.tensor([[0.0, 0, 0], [-0.0499, 0, 0], [0.0499, 0, 0]]).double()  # no third goes in between two
    there = Poses(torch.eye(3).double().repeat(3, 1, 1), places)
    kept, found = overlap_removal.held_without(bodies, there, room, 1)
    assert len(kept) == 2
    left = [bodies[i] for i in kept]
    assert certify(left, file_to_world(left, found.rotation, found.translation), room).holds
    assert overlap_removal.held_without(bodies, there, room, 0) is None
    assert overlap_removal.held_without(bodies, there, room, 1, lambda: True) is None
