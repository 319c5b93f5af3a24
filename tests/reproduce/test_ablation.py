"""Facts of an arrangement against shapes whose gaps, overlaps and shadows are known."""

import numpy as np
import pytest
import torch
import trimesh

from rasp_core.geometry.containers import box
from rasp_core.geometry.meshes import make_body
from rasp_core.optimizer import optimize
from rasp_core.poses import Poses
from rasp_core.problem import Problem, Settings
from rasp_core.reproduce import ablation
from rasp_core.util.errors import InputError

SIZE = {"iterations": 20, "resolution": 64, "query_points": 4000}


def cubes(*centres, edge=0.1):
    mesh = trimesh.creation.box([edge] * 3)
    return [make_body(f"cube{i}", mesh.vertices + centre, mesh.faces) for i, centre in enumerate(centres)]


def still(count):
    return np.repeat(np.eye(4)[None], count, 0)


def test_mean_gap_of_two_cubes():
    bodies = cubes((0, 0, 0), (0.15, 0, 0))
    points = np.random.default_rng(0).uniform(-0.05, 0.05, (200_000, 3))
    axis, side = np.arange(200_000) % 3, np.where(np.arange(200_000) % 2, 0.05, -0.05)
    points[np.arange(200_000), axis] = side
    expected = np.linalg.norm(np.maximum(abs(points - [0.15, 0, 0]) - 0.05, 0), axis=1).mean()
    assert ablation.mean_gap(bodies, still(2), samples=4000) == pytest.approx(expected, rel=0.03)


def test_points_inside_another_count_nothing():
    bodies = [*cubes((0, 0, 0), edge=0.1), *cubes((0, 0, 0), edge=0.3)]
    whole = ablation.mean_gap(bodies, still(2))
    assert whole == pytest.approx(ablation.mean_gap(bodies[::-1], still(2)))
    assert 0 < whole < 0.1  # the inner one adds 0, the outer one its distances to the inner, halved
    assert ablation.mean_gap(bodies[:1], still(1)) == np.inf


def test_judge_of_cubes_that_overlap_and_stick_out():
    bodies = cubes((0, 0, 0), (0.05, 0, 0), (0.2, 0, 0))
    start = Poses(torch.eye(3).repeat(3, 1, 1), torch.tensor(np.array([body.centre for body in bodies])))
    settings = Settings(**{**SIZE, "iterations": 1}, learning_rate=1e-12, final_learning_rate=1e-12)
    facts = ablation.judge(optimize(Problem(bodies, box((0.4, 0.4, 0.4))), settings, start))
    assert facts["overlap"] == pytest.approx(0.5 / 3, abs=1e-4)
    assert facts["extrusion"] == pytest.approx(0.5 / 3, abs=1e-4)
    assert facts["stuck_out"] == pytest.approx(1 / 3)


def test_study_is_an_arrangement_judged(pool):
    facts = ablation.study(pool, "box:0.2,0.2,0.2", 2, start="grid", seed=1, **SIZE)
    assert facts["fault"] == pytest.approx(facts["overlap"] + facts["extrusion"])
    assert 0 < facts["covered"] < 1
    assert all(isinstance(value, float) for value in facts.values())
    again = ablation.study(pool, "box:0.2,0.2,0.2", 2, start="grid", seed=1, **SIZE)
    assert facts.pop("cpu_seconds") > 0 < again.pop("cpu_seconds")
    assert facts == again


@pytest.mark.parametrize("count", [0, 4])
def test_a_count_that_does_not_fit_the_pool(pool, count):
    with pytest.raises(InputError, match="1 to 3"):
        ablation.study(pool, "box:0.2,0.2,0.2", count, **SIZE)


def test_objects_are_as_many_as_fill_a_share(pool):
    facts = ablation.study(pool, "box:0.2,0.2,0.2", filled=0.06, **SIZE)
    assert 0 < facts["filled"] <= 0.06
    with pytest.raises(InputError, match="1 to 3"):
        ablation.study(pool, "box:0.2,0.2,0.2", **SIZE)


def test_a_unit_changes_no_share(pool):
    """Positions in millimetres, epsilon too: the same run but for rounding, which grows with the iterations."""
    size = {**SIZE, "iterations": 3}
    metres = ablation.study(pool, "box:0.15,0.15,0.15", 3, epsilon=0.01, **size)
    millimetres = ablation.study(pool, "box:0.15,0.15,0.15", 3, unit=0.001, epsilon=10.0, **size)
    for name in ("overlap", "extrusion", "covered", "pull of silhouette"):
        assert millimetres[name] == pytest.approx(metres[name], abs=0.02), name


def test_a_course_begins_at_the_start_and_has_a_row_for_every_tenth_iteration():
    bodies, room = cubes((0, 0, 0), (0.05, 0, 0), (0.2, 0, 0)), box((0.4, 0.4, 0.4))
    problem = Problem(bodies, room)
    start = Poses(torch.eye(3).repeat(3, 1, 1), torch.tensor(np.array([body.centre for body in bodies])))
    watched = ablation.Course(problem, 64)
    run = optimize(problem, Settings(**SIZE), start, callback=watched)
    facts = watched.facts(run)
    assert {len(values) for values in facts.values()} == {2}
    assert facts["course of overlap"][0] == pytest.approx(0.5 / 3, abs=1e-4)
    assert facts["course of extrusion"][0] == pytest.approx(0.5 / 3, abs=1e-4)
    assert facts["course of farthest"][0] == pytest.approx(0.05, abs=1e-5)
    dark = (0.4**2 - np.array([0.1 * 0.15 + 0.1 * 0.05, 0.1 * 0.1, 0.1 * 0.2])) / 0.44**2
    assert facts["course of silhouette"][0] == pytest.approx(dark.mean(), rel=0.15)
