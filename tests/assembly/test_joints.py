"""Joints of two boxes whose edges are known, and of shards, against what is looked at one by one."""

import numpy as np
import pytest
import trimesh

from data_fetch import fracture, vessels
from rasp_core.assembly import crease_matching, joints
from rasp_core.assembly.joints import LEDGE, Fits
from rasp_core.assembly.scored_poses import ScoredPose
from rasp_core.geometry.meshes import make_body


@pytest.fixture(scope="module")
def boxes():
    """Two equal boxes, of 0.2 m; laid side by side they are one."""
    mesh = trimesh.creation.box((0.2, 0.2, 0.2))
    return [crease_matching.Piece(make_body(name, mesh.vertices, mesh.faces), 0.005) for name in ("one", "two")]


def looked(boxes, *shifts):
    return Fits(boxes).between(0, 1, np.stack([np.eye(3)] * len(shifts)), np.array(shifts, float))


def test_boxes_side_by_side_share_a_face_and_shifted_ones_have_ledges(boxes):
    side, shifted, away = (0.2, 0, 0), (0.2, 0.05, 0), (0.5, 0, 0)
    found = looked(boxes, side, shifted, away)
    share = (found.own > 0).mean(1)
    assert share[0] == pytest.approx(4 / 12, abs=0.06)  # of a box's twelve edges
    assert share[0] > share[1] > share[2] == 0
    faces = (found.own_marks & 6 > 0).mean(1)
    assert faces[0] == pytest.approx(4 / 12, abs=0.08)
    ledges = LEDGE[found.own_marks].sum(1) + LEDGE[found.other_marks].sum(1)
    assert ledges[1] > 10 * ledges[0]
    assert found.rest[0] == 0
    assert found.worth[0] > 1.5 * found.worth[1]


def test_what_lies_within_counts_against_a_joint(boxes):
    assert looked(boxes, (0.1, 0, 0)).rest[0] < -1


def test_the_other_piece_sees_the_same():
    bodies = fracture(vessels()[2], 2, seed=1)
    pieces = [crease_matching.Piece(body, crease_matching.spacing_of(bodies)) for body in bodies]
    fits, there = Fits(pieces), (bodies[1].centre - bodies[0].centre)[None]
    one, other = fits.between(0, 1, np.eye(3)[None], there), fits.between(1, 0, np.eye(3)[None], -there)
    for seen, again in ((one.own, other.other), (one.own_marks, other.other_marks), (one.rest, other.rest)):
        assert np.array_equal(seen, again)
    right = crease_matching.scored(pieces[1], pieces[0].target, [ScoredPose(np.eye(3), there[0])])
    assert (one.own[0] / pieces[1].weights).sum() + one.rest[0] == pytest.approx(right[0].score, rel=1e-5)
    assert one.taken(np.array([0, 0])).own.shape == one.joined(one).own.shape == (2, len(pieces[1].creases.points))


def test_what_is_forgotten_is_looked_at_again(boxes, monkeypatch):
    monkeypatch.setattr(joints, "KEPT", 3)
    fits, turns = Fits(boxes), np.stack([np.eye(3)] * 4)
    shifts = np.array([[0.2, step, 0] for step in (0, 0.01, 0.02, 0.03)])
    first = fits.between(0, 1, turns, shifts)
    fits.between(0, 1, turns, shifts + np.array([0, 0, 0.01]))
    again = fits.between(0, 1, turns, shifts)
    assert np.array_equal(first.own, again.own)
    assert np.array_equal(first.rest, again.rest)
