"""Matches of creases against a slow loop, the sums against numpy's, and marks of boxes whose faces are known."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from rasp_core.assembly import creases as finding
from rasp_core.geometry import sdf
from rasp_core.geometry.meshes import make_body
from rasp_core.kernels import creases as compiled

REACH, COSINE = 0.3, 0.5


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


@pytest.fixture(scope="module")
def case():
    """Two random sets of crease points in a cube; some of the moving ones are made to lie on resting ones."""
    random = np.random.default_rng(3)
    rest = compiled.Creases(random.random((40, 3)), *unit(random.normal(size=(2, 40, 3))))
    near = random.normal(0, 0.05, (40, 3)) + rest.points
    turned = unit(random.normal(0, 0.2, (2, 40, 3)) + np.stack([-rest.first, rest.second]))
    moving = compiled.Creases(near, *turned)
    moving.first[:10], moving.second[:10] = moving.second[:10].copy(), moving.first[:10].copy()
    vectors = random.normal(0, 0.1, (6, 3))
    vectors[0] = 0
    return rest, moving, Rotation.from_rotvec(vectors).as_matrix(), random.normal(0, 0.03, (6, 3))


def plain(rest, lookup, moving, rotation, translation):
    """For each point of the moving ones: the resting one of its cell if it matches, which sides."""
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
            yield k, near, i, j, distance


def test_matches_are_those_of_a_slow_loop(case):
    rest, moving, rotation, translation = case
    lookup = finding.lookup(rest, REACH, 0.07)
    each = compiled.matches(rest, lookup, moving, rotation, translation, REACH, COSINE)
    found = each.sum(1)
    expected = [
        sum(1 - (d / REACH) ** 2 for *_, d in plain(rest, lookup, moving, *pose))
        for pose in zip(rotation, translation, strict=True)
    ]
    assert min(expected) > 3
    assert found == pytest.approx(np.array(expected), rel=1e-9)
    assert set(np.flatnonzero(each[0])) == {k for k, *_ in plain(rest, lookup, moving, rotation[0], translation[0])}


def test_sums_are_those_of_a_slow_loop(case):
    rest, moving, rotation, translation = case
    lookup = finding.lookup(rest, REACH, 0.07)
    weight, home, own, places, normals = compiled.moments(rest, lookup, moving, rotation, translation, REACH, COSINE)
    for b in range(len(rotation)):
        rows = list(plain(rest, lookup, moving, rotation[b], translation[b]))
        w = np.array([1 / (1 + 4 * (d / REACH) ** 2) for *_, d in rows])
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


def test_marks_say_which_faces_lie_on_another_piece():
    box = trimesh.creation.box((0.4, 0.4, 0.4))
    body = make_body("box", box.vertices, box.faces)
    rest = compiled.Creases(np.array([[0.2, 0.0, 0.2]]), np.array([[1.0, 0, 0]]), np.array([[0.0, 0, 1]]))
    # an edge of another box that lies on the top, its face downwards, and one that looks aside
    moving = compiled.Creases(np.array([[0.0, 0.0, 0.2]]), np.array([[0.0, 0, -1]]), np.array([[1.0, 0, 0]]))
    strips = finding.strips(moving, 0.02)
    assert strips[:, 0] == pytest.approx(np.array([[-0.02, 0, 0.2], [0, 0, 0.22]]))
    shifts = np.array([[0.0, 0, 0], [0.19, 0, 0], [0.19, 0, 0.1], [0.0, 0, -0.1]])
    found = compiled.marks(
        rest,
        finding.lookup(rest, 0.02, 0.01),
        sdf.GridStack([sdf.bake_cached(body, 64)]).arrays,
        body.half_extents,
        moving,
        strips,
        np.stack([np.eye(3)] * 4),
        shifts,
        reach=0.02,
        near=0.01,
        cosine=0.8,
    )
    assert found[:, 0].tolist() == [2, 3, 0, 0]  # on the top; and near its edge; above it; within
