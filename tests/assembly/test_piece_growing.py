"""Assemblies that grow, against where their pieces were cut out."""

import numpy as np
import pytest

from data_fetch import fracture, scatter, vessels
from rasp_core.assembly import piece_growing as growing
from rasp_core.assembly.completion import Completion
from rasp_core.assembly.scored_poses import ScoredPose


def true_poses(moved, truth):
    """Of the pieces' centres, by the motions that bring them back."""
    return [ScoredPose(m[:3, :3], m[:3, :3] @ body.centre + m[:3, 3]) for body, m in zip(moved, truth, strict=True)]


@pytest.fixture(scope="module")
def three():
    moved, truth = scatter(fracture(vessels()[2], 3, seed=1), seed=2)
    return growing.Growing(moved), true_poses(moved, truth)


def assert_right(grown, right):
    for k in grown.poses:
        root = min(grown.poses)
        found = growing.relative(grown.poses[root], grown.poses[k])
        assert not found.differs(growing.relative(right[root], right[k]), np.radians(4), 0.005)


def test_all_pieces_are_joined_and_refined(three):
    grown, right = three[0].grow(), three[1]
    assert set(grown.poses) == {0, 1, 2}
    assert_right(grown, right)
    refined = three[0].refined(grown)
    assert_right(refined, right)
    assert refined.score > 0.9 * grown.score


def test_a_piece_in_no_pair_is_found_beside_all_others(three):
    search, right = three
    grown = search.grow()
    without = growing.Growth({k: grown.poses[k] for k in (0, 1)}, 0.0)
    again = search.add_missing(without)
    assert set(again.poses) == {0, 1, 2}
    assert_right(again, right)
    assert search.add_missing(growing.Growth({}, 0.0)).poses == {}


def test_a_pair_is_completed(three):
    search, right = three
    pair = {k: growing.relative(right[0], right[k]) for k in (0, 1)}
    grown = search.complete(pair)
    assert set(grown.poses) == {0, 1, 2}
    assert_right(grown, right)


def test_a_piece_that_joins_badly_is_foreign():
    moved, truth = scatter(fracture(vessels()[1], 4, seed=1))
    strange = scatter(fracture(vessels()[6], 4, seed=3))[0][-1]
    search = growing.Growing([*moved, strange])
    right = true_poses(moved, truth)
    beside = ScoredPose(np.eye(3), right[0].translation + np.array([moved[0].radius + 0.9 * strange.radius, 0, 0]))
    state = Completion(search.fits, dict(enumerate([*right, beside]))).growth
    assert set(search.without_foreign(state).poses) == {0, 1, 2, 3}


def test_relative_and_after_undo_each_other(three):
    one, other = three[1][:2]
    back = growing.after(one, growing.relative(one, other))
    assert back.rotation == pytest.approx(other.rotation)
    assert back.translation == pytest.approx(other.translation)
