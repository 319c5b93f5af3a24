"""Scores of placed boxes: what coincides counts once, and ledges count against an assembly."""

import numpy as np
import pytest
import trimesh

from rasp_core.assembly import crease_matching
from rasp_core.assembly.completion import Completion, Options
from rasp_core.assembly.joints import Fits
from rasp_core.assembly.scored_poses import ScoredPose, stack
from rasp_core.geometry.meshes import make_body


@pytest.fixture(scope="module")
def fits():
    mesh = trimesh.creation.box((0.2, 0.2, 0.2))
    return Fits([crease_matching.Piece(make_body(f"box{k}", mesh.vertices, mesh.faces), 0.005) for k in range(3)])


def at(*shift):
    return ScoredPose(np.eye(3), np.array(shift, float))


def score(fits, *poses):
    return Completion(fits, dict(enumerate(poses))).growth.score


def test_a_row_of_boxes_counts_each_joint_and_the_same_place_only_once(fits):
    pair = score(fits, at(0, 0, 0), at(0.2, 0, 0))
    row = score(fits, at(0, 0, 0), at(0.2, 0, 0), at(-0.2, 0, 0))
    assert row == pytest.approx(2 * pair, rel=0.05)
    state = Completion(fits, {0: at(0, 0, 0), 1: at(0.2, 0, 0)})
    again = state.joints(2, *stack([at(0.2, 0, 0)]), [0])
    assert state.gains(2, again)[0] == pytest.approx(again[0].worth[0] - again[0].other.sum() / 2, abs=2)


def test_a_ledge_counts_against_it_until_it_is_closed(fits):
    still, shifted, closing = at(0, 0, 0), at(0.2, 0.1, 0), at(0.2, -0.1, 0)
    flush, ledge = score(fits, still, at(0.2, 0, 0)), score(fits, still, shifted)
    assert ledge < 0.3 * flush
    assert score(fits, still, shifted, closing) > score(fits, still, shifted) + score(fits, still, closing) + 5


def test_what_is_gained_is_what_the_score_rises_by_but_for_ledges(fits):
    state = Completion(fits, {0: at(0, 0, 0)})
    joints = state.joints(1, *stack([at(0.2, 0, 0)]))
    gain = state.gains(1, joints)[0]
    state.add(1, at(0.2, 0, 0), joints)
    assert state.growth.score == pytest.approx(gain, abs=4)
    assert state.growth.poses[1].score == pytest.approx(joints[0].own.sum())


def test_options_are_joined_and_different(fits):
    state = Completion(fits, {0: at(0, 0, 0)})
    rows = [at(0.2, 0, 0), at(0.2001, 0, 0), at(0, 0.2, 0)]
    options = Options(*stack(rows), state.joints(1, *stack(rows)), np.ones(3))
    nothing = Options(*stack([]), {}, np.zeros(0))
    assert nothing.joined(options) is options
    assert options.joined(options).joints[0].rest.shape == (6,)
    left = options.distinct(0.1, 0.01, 5)
    assert left.translation == pytest.approx(np.array([[0.2, 0, 0], [0, 0.2, 0]]))
