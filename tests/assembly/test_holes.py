"""Holes of assemblies whose missing piece is known."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from data_fetch import fracture, vessels
from rasp_core.assembly import crease_matching
from rasp_core.assembly.holes import Hole, find_holes
from rasp_core.assembly.scored_poses import ScoredPose
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.surface_points import surface_points


@pytest.fixture(scope="module")
def shards():
    return fracture(vessels()[1], 4, seed=1)


def holes_of(bodies):
    spacing = crease_matching.spacing_of(bodies)
    pieces = [crease_matching.Piece(body, spacing) for body in bodies]
    return find_holes(pieces, [ScoredPose(np.eye(3), body.centre) for body in bodies])


def test_a_whole_thing_has_none(shards):
    assert holes_of(shards) == []


def test_a_missing_piece_leaves_one_where_it_was(shards):
    missing, left = shards[1], [shards[0], *shards[2:]]
    [hole] = holes_of(left)
    assert np.linalg.norm(hole.centre - missing.centre) < missing.radius
    points, _ = surface_points(missing.solid_vertices, missing.solid_faces, 20_000)
    rest = np.concatenate([surface_points(b.placed(np.eye(4)), b.solid_faces, 40_000)[0] for b in left])
    broken = (cKDTree(rest).query(points + missing.centre)[0] < 0.001).mean() * missing.manifold.surface_area()
    assert 0.5 * broken < hole.area < 2 * broken


def test_pieces_without_creases_have_none():
    mesh = trimesh.creation.icosphere(3, 0.05)
    assert holes_of([make_body("ball", mesh.vertices, mesh.faces)] * 2) == []


def test_a_hole_is_plain_numbers_in_a_record():
    assert Hole(np.array([1.0, 2.0, 3.0]), 0.5).to_dict() == {"centre": [1.0, 2.0, 3.0], "area": 0.5}
