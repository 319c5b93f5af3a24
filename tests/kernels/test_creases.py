"""Matches of creases against a slow loop, and the sums against numpy's."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rasp_core.assembly import creases as finding
from rasp_core.kernels import creases as compiled

REACH, COSINE = 0.3, 0.5


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


@pytest.fixture(scope="module")
def case():
    """Two random sets of crease points in a cube; some of the moving ones are made to lie on resting ones."""
    random = np.random.default_rng(3)
    rest = compiled.Creases(
        random.random((40, 3)), *unit(random.normal(size=(2, 40, 3))), random.uniform(0.3, 1, (40, 2))
    )
    near = random.normal(0, 0.05, (40, 3)) + rest.points
    turned = unit(random.normal(0, 0.2, (2, 40, 3)) + np.stack([-rest.first, rest.second]))
    moving = compiled.Creases(near, *turned, random.uniform(0.3, 1, (40, 2)))
    moving.first[:10], moving.second[:10] = moving.second[:10].copy(), moving.first[:10].copy()
    vectors = random.normal(0, 0.1, (6, 3))
    vectors[0] = 0
    return rest, moving, Rotation.from_rotvec(vectors).as_matrix(), random.normal(0, 0.03, (6, 3))


def plain(rest, lookup, moving, rotation, translation):
    """For each point of the moving ones: the resting one of its cell if it matches, which sides, what it counts."""
    for k in range(len(moving.points)):
        place = rotation @ moving.points[k] + translation
        cell = np.floor((place - lookup.origin) / lookup.cell).astype(int)
        if (cell < 0).any() or (cell >= lookup.nearest.shape).any() or lookup.nearest[tuple(cell)] < 0:
            continue
        near = lookup.nearest[tuple(cell)]
        distance = np.linalg.norm(rest.points[near] - place)
        sides = {}
        for i, j in np.ndindex(2, 2):
            broken, whole = rest[1 + i][near], rest[2 - i][near]
            own_broken, own_whole = rotation @ moving[1 + j][k], rotation @ moving[2 - j][k]
            sides[i, j] = min(-broken @ own_broken, whole @ own_whole)
        i, j = max(sides, key=sides.get)
        if distance < REACH and sides[i, j] > COSINE:
            yield k, near, i, j, distance, min(rest.weights[near, i], moving.weights[k, j])


def test_matches_are_those_of_a_slow_loop(case):
    rest, moving, rotation, translation = case
    lookup = finding.lookup(rest, REACH, 0.07)
    found = compiled.matched(rest, lookup, moving, rotation, translation, REACH, COSINE)
    expected = [
        sum(counts * (1 - (d / REACH) ** 2) for *_, d, counts in plain(rest, lookup, moving, *pose))
        for pose in zip(rotation, translation, strict=True)
    ]
    assert min(expected) > 3
    assert found == pytest.approx(np.array(expected), rel=1e-9)


def test_sums_are_those_of_a_slow_loop(case):
    rest, moving, rotation, translation = case
    lookup = finding.lookup(rest, REACH, 0.07)
    weight, home, own, places, normals = compiled.moments(rest, lookup, moving, rotation, translation, REACH, COSINE)
    for b in range(len(rotation)):
        rows = list(plain(rest, lookup, moving, rotation[b], translation[b]))
        w = np.array([counts / (1 + 4 * (d / REACH) ** 2) for *_, d, counts in rows])
        p, q = rest.points[[row[1] for row in rows]], moving.points[[row[0] for row in rows]]
        assert weight[b] == pytest.approx(w.sum())
        assert home[b] == pytest.approx(w @ p)
        assert own[b] == pytest.approx(w @ q)
        assert places[b] == pytest.approx((p * w[:, None]).T @ q)
        outer = [
            x * (np.outer(rest[2 - i][n], moving[2 - j][k]) - np.outer(rest[1 + i][n], moving[1 + j][k]))
            for x, (k, n, i, j, *_) in zip(w, rows, strict=True)
        ]
        assert normals[b] == pytest.approx(sum(outer))
