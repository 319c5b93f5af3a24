"""Runs of voxels beside whole arrays of them."""

import numpy as np
import pytest

from rasp_core.kernels import voxel_runs
from rasp_core.packing.voxel_bodies import in_runs, laid_out
from rasp_core.packing.voxel_correlation import Turned

ROOM = np.array([9, 8, 10])
SHIFTS = np.array([[1, 2, 3], [2, 1, 4], [3, 3, 5], [0, 2, 2]])
WEIGHTS = np.array([1.0, 1.0, 2.0, 3.0], np.float32)


@pytest.fixture
def arrays():
    """Four random bodies."""
    random = np.random.default_rng(1)
    return [random.random(tuple(random.integers(3, 6, 3))) < 0.6 for _ in SHIFTS]


@pytest.fixture
def voxels(arrays):
    return laid_out([in_runs(Turned(np.eye(3), one, np.zeros(3)), 4) for one in arrays])


@pytest.fixture
def placed():
    return voxel_runs.Placed(np.arange(4), SHIFTS.copy())


def taken(array, shift):
    room = np.zeros(ROOM)
    room[tuple(slice(s, s + n) for s, n in zip(shift, array.shape, strict=True))] = array
    return room


def overlap(arrays, shift):
    """Of the first body at a shift."""
    mine = taken(arrays[0], shift)
    others = zip(WEIGHTS[1:], arrays[1:], SHIFTS[1:], strict=True)
    return sum(weight * np.cbrt((mine * taken(one, there)).sum()) for weight, one, there in others)


def test_blocks_are_sums_of_weighted_voxels(arrays, voxels, placed):
    blocks = np.ones((3, 2, 3), np.float32)
    voxel_runs.add_up(blocks, voxels, placed, WEIGHTS - 1, 4)
    expected = np.zeros((12, 8, 12))
    for weight, one, shift in zip(WEIGHTS - 1, arrays, SHIFTS, strict=True):
        expected[:9, :, :10] += weight * taken(one, shift)
    assert np.allclose(blocks, expected.reshape(3, 4, 2, 4, 3, 4).sum((1, 3, 5)))


def test_pairs_share_what_their_arrays_share(arrays, voxels, placed):
    rooms = [taken(one, shift) for one, shift in zip(arrays, SHIFTS, strict=True)]
    expected = [[0 if a is b else int((a * b).sum()) for b in rooms] for a in rooms]
    assert voxel_runs.shared_by_pairs(voxels, placed).tolist() == expected
    assert np.count_nonzero(expected) > 6


def test_overlap_is_the_weighted_sum_of_cube_roots(arrays, voxels, placed):
    found = voxel_runs.overlap(voxels, placed, 0, 0, SHIFTS[0], WEIGHTS, np.float32(np.inf))
    assert found == pytest.approx(overlap(arrays, SHIFTS[0]), rel=1e-5)
    assert voxel_runs.overlap(voxels, placed, 0, 0, SHIFTS[0], WEIGHTS, np.float32(found / 2)) > found / 2


@pytest.mark.parametrize("refined", [1, 3])
def test_the_best_place_is_no_worse_than_any_and_no_step_is_better(arrays, voxels, placed, refined):
    room = ROOM - arrays[0].shape
    starts = np.random.default_rng(2).integers(0, room + 1, (20, 3))
    before = starts.copy()
    present = np.float32(overlap(arrays, SHIFTS[0]))
    turn, shift, value = voxel_runs.best_place(
        voxels, placed, 0, WEIGHTS, ROOM, np.zeros(20, np.int64), starts, refined, 2, present
    )
    assert turn == 0
    assert value == pytest.approx(overlap(arrays, shift), abs=1e-5)
    assert value <= min(overlap(arrays, start) for start in (*starts, SHIFTS[0])) + 1e-5
    steps = [shift + step for step in (*np.eye(3, dtype=int), *-np.eye(3, dtype=int))]
    within = [step for step in steps if (step >= 0).all() and (step <= room).all()]
    assert value == 0 or min(overlap(arrays, step) for step in within) >= value - 1e-5
    assert (starts == before).all()


def test_a_body_that_shares_nothing_stays(voxels, placed):
    alone = voxel_runs.Placed(placed.turn[:1], placed.shift[:1])
    starts = np.zeros((3, 3), np.int64)
    nothing = np.float32(0)
    found = voxel_runs.best_place(voxels, alone, 0, WEIGHTS[:1], ROOM, np.zeros(3, np.int64), starts, 2, 2, nothing)
    assert (found[0], found[1].tolist(), found[2]) == (0, SHIFTS[0].tolist(), 0)
