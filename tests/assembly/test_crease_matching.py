"""Poses of one shard beside another, against where both were cut out."""

import numpy as np
import pytest
import trimesh

from data_fetch import fracture, vessels
from rasp_core.assembly import crease_matching as matching
from rasp_core.assembly.scored_poses import ScoredPose
from rasp_core.geometry.meshes import make_body


@pytest.fixture(scope="module")
def pair():
    bodies = fracture(vessels()[2], 2, seed=1)
    return [matching.Piece(body, matching.spacing_of(bodies)) for body in bodies]


def truth(pair):
    return ScoredPose(np.eye(3), pair[1].body.centre - pair[0].body.centre)


def test_the_true_pose_comes_first(pair):
    best = matching.find_poses(pair[1], pair[0].target, np.random.default_rng(0))[0]
    right = matching.scored(pair[1], pair[0].target, [truth(pair)])[0]
    assert not best.differs(right, np.radians(3), 0.03 * pair[1].body.radius)
    assert best.score > 0.9 * right.score


def test_creases_and_surfaces_draw_a_shifted_piece_home(pair):
    right = truth(pair)
    turn = np.array([[np.cos(0.02), -np.sin(0.02), 0], [np.sin(0.02), np.cos(0.02), 0], [0, 0, 1]])
    rotation, translation = turn[None], (right.translation + 0.3 * pair[0].spacing)[None]
    placed = [(pair[0], ScoredPose(np.eye(3), np.zeros(3)))]

    def between(piece, target, rotation, translation):
        found = matching.drawn_between(piece, ScoredPose(rotation[0], translation[0]), placed)
        return found.rotation[None], found.translation[None]

    for draw in (matching.drawn_in, between, matching.pressed):
        turned, shifted = rotation, translation
        for _ in range(4):
            turned, shifted = draw(pair[1], pair[0].target, turned, shifted)
        assert np.degrees(np.arccos((np.trace(turned[0]) - 1) / 2)) < 0.6
        assert np.linalg.norm(shifted[0] - right.translation) < 0.3 * np.linalg.norm(translation[0] - right.translation)


def test_no_matches_leave_a_pose_as_it_is(pair):
    far = np.eye(3)[None], np.full((1, 3), 9.0)
    turned, shifted = matching.drawn_in(pair[1], pair[0].target, *far)
    assert (turned == far[0]).all()
    assert (shifted == far[1]).all()
    assert matching.scored(pair[1], pair[0].target, [ScoredPose(far[0][0], far[1][0])])[0].score == 0
    assert matching.scored(pair[1], pair[0].target, []) == []
    alone = ScoredPose(far[0][0], far[1][0])
    assert matching.drawn_between(pair[1], alone, [(pair[0], ScoredPose(np.eye(3), np.zeros(3)))]) is alone


def test_what_lies_within_another_is_counted():
    small, large = (trimesh.creation.box((edge, edge, edge)) for edge in (0.1, 0.2))
    small, large = (matching.Piece(make_body("box", m.vertices, m.faces), 0.01) for m in (small, large))
    shifts = np.array([[0, 0, 0], [0.1, 0, 0], [0.3, 0, 0]])
    inside = matching.within(small, large.target, np.stack([np.eye(3)] * 3), shifts)
    assert inside[0] == pytest.approx(len(small.points))
    assert 0.3 < inside[1] / inside[0] < 0.6  # half of it, less a layer that counts as contact
    assert inside[2] == 0


def test_spacing_is_of_all_points_together(pair):
    bodies = [piece.body for piece in pair]
    area = sum(body.manifold.surface_area() for body in bodies)
    assert area / matching.spacing_of(bodies) ** 2 == pytest.approx(matching.SETTINGS.points)
    many = area * 4 / matching.spacing_of(bodies * 4) ** 2
    assert many == pytest.approx(8 * matching.SETTINGS.piece_points)
