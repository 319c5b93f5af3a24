"""Runs of voxels beside whole arrays of them."""

import numpy as np
import pytest

from rasp_core.kernels import voxel_runs

ROOM = (9, 8, 10)


def runs_of(voxels):
    edges = np.diff(np.pad(voxels, ((0, 0), (0, 0), (1, 1))).astype(np.int8), axis=2)
    return np.column_stack([np.argwhere(edges == 1), np.argwhere(edges == -1)[:, 2]]).astype(np.int32)


@pytest.fixture
def bodies():
    """Four random bodies: their voxels, runs, where these begin and end, shifts and sizes."""
    random = np.random.default_rng(1)
    voxels = [random.random(tuple(random.integers(2, 6, 3))) < 0.6 for _ in range(4)]
    runs = [runs_of(one) for one in voxels]
    end = np.cumsum([len(one) for one in runs])
    sizes = np.array([one.shape for one in voxels])
    shifts = random.integers(0, np.array(ROOM) - sizes + 1)
    return voxels, np.concatenate(runs), end - [len(one) for one in runs], end, shifts, sizes


def taken(voxels, shift):
    room = np.zeros(ROOM)
    room[tuple(slice(s, s + n) for s, n in zip(shift, voxels.shape, strict=True))] = voxels
    return room


def field_of(bodies, weights):
    voxels, runs, begin, end, shifts, _ = bodies
    field = np.ones(ROOM, np.float32)
    voxel_runs.weigh(field, runs, begin, end, shifts, weights.astype(np.float32))
    expected = sum(w * taken(one, shift) for w, one, shift in zip(weights, voxels, shifts, strict=True))
    assert np.allclose(field, expected)
    sums, blocks = np.empty((*ROOM[:2], ROOM[2] + 1), np.float32), np.empty((3, 2, 3), np.float32)
    voxel_runs.add_up(field, sums, blocks, 4)
    assert np.allclose(sums[:, :, 1:], np.cumsum(expected, 2))
    assert blocks[1, 1, 2] == pytest.approx(expected[4:8, 4:8, 8:].sum())
    return expected, sums


def test_what_is_shared_is_what_the_arrays_share(bodies):
    voxels, runs, begin, end, shifts, _ = bodies
    expected, sums = field_of(bodies, np.array([0.0, 1.0, 2.0, 3.0]))
    ends, at = voxel_runs.ends(runs, ROOM), int(np.ravel_multi_index(tuple(shifts[0]), sums.shape))
    found = voxel_runs.shared(sums.ravel(), ends, begin[0], end[0], at, np.float32(np.inf))
    assert found == pytest.approx((expected * taken(voxels[0], shifts[0])).sum(), rel=1e-5)
    assert voxel_runs.shared(sums.ravel(), ends, begin[0], end[0], at, np.float32(found / 2)) > found / 2


def test_pairs_share_what_their_arrays_share(bodies):
    voxels, runs, begin, end, shifts, sizes = bodies
    mark = np.zeros(ROOM, np.int8)
    found = voxel_runs.shared_by_pairs(mark, runs, begin, end, shifts, sizes)
    rooms = [taken(one, shift) for one, shift in zip(voxels, shifts, strict=True)]
    assert found.tolist() == [[0 if a is b else int((a * b).sum()) for b in rooms] for a in rooms]
    assert not mark.any()


def test_downhill_never_ends_higher_and_no_step_is_lower(bodies):
    voxels, runs, begin, end, _, sizes = bodies
    expected, sums = field_of(bodies, np.array([0.0, 1.0, 1.0, 1.0]))
    room = np.array(ROOM) - sizes[0]
    starts = np.random.default_rng(2).integers(0, room + 1, (20, 3))
    shifts, same = starts.copy(), np.zeros(20, np.int64)
    ends = voxel_runs.ends(runs, ROOM)
    found = voxel_runs.descend(sums, ends, begin[same], end[same], sizes[same], shifts, 2)

    def at(shift):
        return (expected * taken(voxels[0], shift)).sum()

    for start, shift, value in zip(starts, shifts, found, strict=True):
        assert value == pytest.approx(at(shift), abs=1e-4)
        assert value <= at(start) + 1e-4
        steps = [shift + step for step in (*np.eye(3, dtype=int), *-np.eye(3, dtype=int))]
        assert value == 0 or all(at(s) >= value - 1e-4 for s in steps if (s >= 0).all() and (s <= room).all())
