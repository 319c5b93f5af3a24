"""The turns that are wished of parts."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.wishes import quarter_turns, turns_of
from rasp_core.util.errors import InputError
from tests.judge import off_by

BLOCK = trimesh.creation.box((3, 2, 1))
BODY = make_body("block", BLOCK.vertices, BLOCK.faces)
LARGEST = {"flat:1": [[0, 0, 1], [0, 0, -1]], "flat:2": [[0, 0, 1], [0, 0, -1]]}


def test_any_turn_is_no_wish():
    assert turns_of("any", BODY.manifold) is None
    assert turns_of(" ANY ", BODY.manifold) is None


@pytest.mark.parametrize("word", ["z", "90", "none", "flat:1", "flat:2"])
def test_all_turns_that_are_given_are_of_those_asked(word):
    turns, random = turns_of(word, BODY.manifold), np.random.default_rng(0)
    some = [*turns.straight(), *(turns.random(random) for _ in range(20))]
    some += [turns.nearest(one) for one in Rotation.random(20, random_state=1).as_matrix()]
    for turn in some:
        assert np.linalg.det(turn) == pytest.approx(1)
        assert turn @ turn.T == pytest.approx(np.eye(3))
        assert off_by(word, turn, LARGEST.get(word)) < 1e-12
    assert len(turns.straight()) == {"z": 4, "90": 24, "none": 1, "flat:1": 4, "flat:2": 8}[word]
    assert turns.freedom.tolist() == [0, 0, word not in ("90", "none")]


@pytest.mark.parametrize("word", ["z", "90", "none", "flat:6"])
def test_the_nearest_turn_is_none_other_than_itself(word):
    turns, random = turns_of(word, BODY.manifold), np.random.default_rng(0)
    for _ in range(10):
        turn = turns.random(random)
        assert turns.nearest(turn) == pytest.approx(turn)
        off = Rotation.from_rotvec(random.normal(size=3) * 0.05).as_matrix() @ turn
        angle = Rotation.from_matrix(turns.nearest(off) @ turn.T).magnitude()
        assert angle < 0.3


def test_a_block_lies_on_all_six_faces_and_no_more():
    turns = turns_of("flat:9", BODY.manifold)
    down = np.array([base.T @ (0, 0, -1) for base in turns.bases])
    assert sorted(map(tuple, down.round(9) + 0.0)) == sorted(
        [(0, 0, 1), (0, 0, -1), (0, 1, 0), (0, -1, 0), (1, 0, 0), (-1, 0, 0)]
    )
    assert np.abs(down[:2, 2]).tolist() == [1, 1], "the largest first"


def test_a_bowl_lies_on_its_hull():
    cone = trimesh.creation.cone(1.0, 0.5, sections=60)
    (base,) = turns_of("flat:1", make_body("cone", cone.vertices, cone.faces).manifold).bases
    assert base == pytest.approx(np.eye(3)), "it stands on its disc already"


def test_turns_of_a_list_are_these_and_no_others():
    turns = turns_of("0 0 0; 90 0 0; 0 90 45", BODY.manifold)
    x, y = turns.bases[1] @ (0, 1, 0), turns.bases[2] @ (0, 0, 1)
    assert x == pytest.approx([0, 0, 1]), "about x, y goes to z"
    assert y == pytest.approx([0.5**0.5, 0.5**0.5, 0]), "about y first, then about z"
    assert not turns.freedom.any()
    assert len(turns.straight()) == 3
    assert turns.nearest(turns.bases[2]) == pytest.approx(turns.bases[2])


def test_quarter_turns_are_all_24():
    assert len({turn.tobytes() for turn in quarter_turns()}) == 24


@pytest.mark.parametrize("word", ["x", "flat", "flat:", "flat:0", "flat:-1", "45", ""])
def test_other_words_are_refused(word):
    with pytest.raises(InputError, match=r"turns must be any, z, 90, flat:N, none, or angles .*; 90 0 0, got"):
        turns_of(word, BODY.manifold)
