"""Poses from alike pairs of points, against motions that are known."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from data_fetch import vessels
from rasp_core.assembly.point_pair_features import poses


def surface(body, count, seed):
    """Points of a body's surface, and their normals."""
    mesh = trimesh.Trimesh(body.solid_vertices, body.solid_faces, process=False)
    points, faces = trimesh.sample.sample_surface(mesh, count, seed=seed)
    return np.asarray(points), np.asarray(mesh.face_normals[faces])


@pytest.fixture(scope="module")
def boat():
    """A gravy boat, which no motion brings onto itself."""
    return vessels()[3]


def errors(found, rotation, shift):
    """Radians and metres between poses and the true one, at the origin."""
    turns, shifts = found
    chord = np.linalg.norm(turns - rotation, axis=(1, 2)) / np.sqrt(8)
    return 2 * np.arcsin(np.clip(chord, 0, 1)), np.linalg.norm(shifts - shift, axis=1)


def test_the_true_motion_is_among_the_poses_far_more_often_than_by_chance(boat):
    rotation, shift = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix(), np.array([0.3, -0.2, 0.1])
    points, normals = surface(boat, 3000, seed=1)
    there = points @ rotation.T + shift, normals @ rotation.T
    found = poses(surface(boat, 600, seed=0), there, np.arange(3000), 2 * boat.radius, np.random.default_rng(0))
    angle, away = errors(found, rotation, shift)
    assert len(angle) > 5000
    np.testing.assert_allclose(found[0] @ found[0].swapaxes(1, 2), np.tile(np.eye(3), (len(angle), 1, 1)), atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(found[0]), 1)
    right = ((angle < 0.15) & (away < 0.01)).mean()
    by_chance = (Rotation.random(100_000, random_state=0).magnitude() < 0.15).mean()  # without the shift
    assert right > 10 * by_chance


def test_a_mirror_image_is_not_the_same(boat):
    """What would bring the boat onto its mirror image is no motion, and the features tell the two apart."""
    points, normals = surface(boat, 3000, seed=1)
    part = surface(boat, 600, seed=0)
    own = poses(part, (points, normals), np.arange(3000), 2 * boat.radius, np.random.default_rng(0))
    # the vessel is its own mirror image across its long plane, so a lopsided part of it is taken
    lopsided = points[:, 1] > 0.2 * points[:, 0]
    kept = part[0][:, 1] > 0.2 * part[0][:, 0]
    part = part[0][kept], part[1][kept]
    flip = np.array([1.0, -1.0, 1.0])
    mirrored = points[lopsided] * flip, normals[lopsided] * flip
    references = np.arange(lopsided.sum())
    other = poses(part, mirrored, references, 2 * boat.radius, np.random.default_rng(0))

    def best(found, onto):
        tree = cKDTree(onto)
        moved = part[0][None] @ found[0].swapaxes(1, 2) + found[1][:, None]
        return (tree.query(moved[:2000].reshape(-1, 3))[0].reshape(-1, len(part[0])) ** 2).mean(1).min()

    assert best(own, points) < 0.25 * best(other, mirrored[0])


def test_nothing_alike_gives_no_poses(boat):
    part = surface(boat, 600, seed=0)
    tiny = part[0] / 100, part[1]
    rotation, shift = poses(part, tiny, np.arange(600), 2 * boat.radius, np.random.default_rng(0))
    assert rotation.shape == (0, 3, 3)
    assert shift.shape == (0, 3)


def test_poses_bring_points_to_the_references(boat):
    part, points = surface(boat, 600, seed=0), surface(boat, 3000, seed=1)
    bow = np.flatnonzero(points[0][:, 0] > 0.06)
    rotation, shift = poses(part, points, bow, 2 * boat.radius, np.random.default_rng(0))
    moved = part[0][None, ::10] @ rotation[:200].swapaxes(1, 2) + shift[:200, None]
    nearest = np.linalg.norm(moved[:, :, None] - points[0][bow][None, None, ::5], axis=-1).min((1, 2))
    assert np.median(nearest) < 0.01
