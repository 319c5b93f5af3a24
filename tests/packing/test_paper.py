"""The paper's packings are certified, seeded, and refuse what cannot fit."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from data_fetch import kitchen_like, torus
from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import Container, box
from rasp_core.geometry.meshes import make_body
from rasp_core.packing import paper
from rasp_core.problem import Settings
from rasp_core.util.errors import InputError

QUICK = Settings(iterations=100, query_points=10_000, resolution=64)
ROOM = box((0.2, 0.2, 0.2))


@pytest.fixture(scope="module")
def pool():
    return kitchen_like(24)


@pytest.fixture(scope="module")
def packed(pool):
    return paper.pack(pool, ROOM, settings=QUICK)


def test_a_search_ends_with_a_certified_packing_of_different_objects(pool, packed):
    arrangement = packed.arrangement
    assert packed.certificate.holds
    assert certify(packed.bodies, arrangement.matrices, ROOM).holds
    assert [pool[i] for i in packed.chosen] == packed.bodies
    assert len(set(packed.chosen)) == len(packed.chosen) >= 3
    assert packed.density == pytest.approx(sum(pool[i].volume for i in packed.chosen) / 0.008)
    assert packed.rounds[-1]["objects"] == len(packed.chosen)
    assert packed.history.shape[1] == 5
    assert (packed.arrangement.pulls[:, 0] > 0).all(), "shadows pull from the first iteration to the last"


def test_the_same_seed_gives_the_same_packing_whoever_watches(pool):
    small, quick, seen = box((0.14, 0.14, 0.14)), replace(QUICK, iterations=60), []
    first = paper.pack(pool[:12], small, settings=quick)
    again = paper.pack(pool[:12], small, settings=quick, watch=lambda *told: seen.append(told))
    assert again.chosen == first.chosen
    assert np.array_equal(again.matrices, first.matrices)
    assert [losses is None for _, _, losses in seen[:19]] == [False] * 18 + [True], "18 iterations, then what is judged"
    assert sum(losses is None for _, _, losses in seen) == len(again.rounds)
    assert [len(chosen) for chosen, _, losses in seen if losses is None] == [r["objects"] for r in again.rounds]
    chosen, poses, _ = seen[-1]
    assert chosen == again.chosen
    assert np.array_equal(poses.translation, again.poses.translation)


def test_a_mesh_container_with_a_hole_is_packed(pool):
    ring = Container(torus(0.15, 0.06))
    packed = paper.pack(pool[:12], ring, settings=replace(QUICK, iterations=100))
    assert packed.certificate.holds
    assert len(packed.chosen) >= 2


def test_a_fixed_count_is_arranged_without_search_and_reported_as_it_is(pool):
    packed = paper.pack(pool, ROOM, count=20, settings=QUICK)
    assert len(packed.chosen) == 20
    assert len(packed.history) == QUICK.iterations
    assert not packed.certificate.holds, "twenty objects of 8 cm do not fit into 20 cm in 200 iterations"


def test_without_shadows_none_pull(pool):
    settings = replace(QUICK, iterations=60, weighting="no_shadows", epsilon=1e-3)
    packed = paper.pack(pool[:12], box((0.14, 0.14, 0.14)), settings=settings)
    assert packed.certificate.holds
    assert (packed.arrangement.pulls[:, 0] == 0).all()


def test_ctrl_c_ends_with_what_holds(pool, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(paper._Run, "_grow", interrupt)
    packed = paper.pack(pool, ROOM, settings=replace(QUICK, iterations=60))
    assert packed.arrangement.interrupted
    assert packed.certificate.holds


def test_a_time_limit_ends_with_what_holds_as_it_lies(pool):
    packed = paper.pack(pool, ROOM, settings=QUICK, time_limit=1e-3)
    assert packed.certificate.holds
    assert packed.arrangement.interrupted
    bodies, matrices = packed.bodies, packed.arrangement.matrices
    assert len(bodies) == len(packed.chosen)
    assert certify(bodies, matrices, ROOM).holds
    # the images are of what is left
    covered = (packed.arrangement.images >= 0.5).mean()
    assert 0 < covered < 0.8


def test_half_of_a_time_limit_is_left_to_separation(pool, monkeypatch):
    over = []
    monkeypatch.setattr(paper.Budget, "spent", lambda budget, fraction=1.0: fraction <= 0.5)  # half of the time is over
    for step in ("_descend", "_settle", "_grow"):
        monkeypatch.setattr(paper._Run, step, lambda run, *separation: over.append(run.spent()))
    paper.pack(pool, ROOM, settings=QUICK, time_limit=60)
    assert over == [True, False, False]


def test_the_initial_count_is_the_papers(pool):
    mean = np.mean([body.volume for body in pool])
    assert paper.initial_count(pool, box((0.1, 0.1, 0.1))) == round(0.001 / mean)
    assert paper.initial_count(pool, box((9, 9, 9))) == len(pool)
    assert paper.initial_count(pool, box((0.01, 0.01, 0.01))) == 1


def test_a_pool_of_which_nothing_can_be_placed_says_so():
    """Two blocks that fill the room each but for a hair: their tests of size pass, their packing cannot."""
    cube = trimesh.creation.box([0.1999] * 3)
    blocks = [make_body(name, cube.vertices, cube.faces) for name in "ab"]
    with pytest.raises(InputError, match="not one of the objects"):
        paper.pack(blocks, ROOM, settings=QUICK, time_limit=0.01)


@pytest.mark.parametrize("count", [0, 25, -1])
def test_impossible_counts_are_refused(pool, count):
    with pytest.raises(InputError, match="count must lie between 1 and the 24"):
        paper.pack(pool, ROOM, count)


def test_a_search_adds_what_still_fits(packed):
    """Few objects are left by dropping from a start that a short first round spoils; then others are added."""
    added = [r for r in packed.rounds if r["added"]]
    dropped = [r for r in packed.rounds if not r["added"]]
    assert added
    assert packed.certificate.holds
    assert packed.density == pytest.approx(max(r["density"] for r in added))
    assert packed.density > dropped[-1]["density"]


def test_simplified_surfaces_give_volumes_that_are_near():
    """Two fine balls whose lens is known: 4 pi r^3 / 3 is cut by two caps of height r - d / 2."""
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.05)
    bodies = [make_body(name, ball.vertices, ball.faces) for name in ("one", "other")]
    rough = [body.simplified(paper.TUNING.simplified_by_of_radius * body.radius) for body in bodies]
    matrices = np.tile(np.eye(4), (2, 1, 1))
    matrices[1, 0, 3] = 0.06
    lens = 2 * np.pi * 0.02**2 * (3 * 0.05 - 0.02) / 3
    room = box((0.3, 0.3, 0.3))
    (exact,) = certify(bodies, matrices, room).overlaps
    (near,) = certify(rough, matrices, room).overlaps
    assert exact.volume == pytest.approx(lens, rel=0.005)
    assert near.volume == pytest.approx(lens, rel=0.05)
    assert near.volume != exact.volume
    assert (near.first, near.second) == ("one", "other")
    assert rough[0].volume == bodies[0].volume
    assert rough[0].manifold.num_tri() < 0.5 * len(ball.faces)
    assert bodies[0].manifold.num_tri() == len(ball.faces)


def test_a_foil_that_simplifies_to_nothing_is_no_fault():
    """Thinner than a surface may stray: the certificate, which is by the body itself, still sees it."""
    foil = trimesh.creation.box((0.1, 0.1, 1e-5))
    bodies = [make_body(name, foil.vertices, foil.faces) for name in ("one", "other")]
    matrices = np.tile(np.eye(4), (2, 1, 1))
    room = box((0.3, 0.3, 0.3))
    rough = [body.simplified(paper.TUNING.simplified_by_of_radius * body.radius) for body in bodies]
    assert certify(rough, matrices, room).overlap_volume < 2 * bodies[0].volume
    assert not certify(bodies, matrices, room).holds
