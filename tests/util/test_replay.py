"""The loop on a GPU: what is recorded and played is what is computed step by step. Where there is no GPU, skipped."""

from dataclasses import replace

import pytest
import torch

from data_fetch import kitchen_like
from rasp_core import iteration, optimizer
from rasp_core.geometry import containers
from rasp_core.poses import Poses
from rasp_core.problem import Problem, Settings

pytestmark = pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU is here")

SETTINGS = Settings(iterations=120, query_points=20_000, resolution=128)


@pytest.fixture(scope="module")
def problem():
    return Problem(kitchen_like(16), containers.box((0.25, 0.25, 0.25)))


def fresh(problem, settings=SETTINGS):
    start = Poses.random(problem.bodies, problem.container, 0)
    scene = problem.scene("cuda", viewing_volume=settings.viewing_volume)
    return iteration.init(problem, settings, start, scene)


def test_played_iterations_are_those_of_step(problem):
    """But for rounding, which grows from iteration to iteration."""
    played, stepped = fresh(problem), fresh(problem)
    optimizer.run(played, lambda step: step.iteration == 14)
    for _ in range(15):
        iteration.step(stepped)
    assert played.replay is not None
    assert stepped.replay is None
    assert played.losses() == pytest.approx(stepped.losses(), rel=1e-3)
    assert played.pulled() == pytest.approx(stepped.pulled(), rel=1e-2)
    for ours, theirs in zip(played.adam.parameters, stepped.adam.parameters, strict=True):
        assert (ours - theirs).abs().max() < 1e-3 * theirs.abs().max()


def test_two_runs_are_the_same_bit_for_bit(problem):
    one, other = (optimizer.optimize(problem, SETTINGS, device="cuda") for _ in range(2))
    assert torch.equal(one.rotation, other.rotation)
    assert torch.equal(one.translation, other.translation)
    assert (one.history == other.history).all()


def test_on_the_cpu_it_goes_the_same_way_at_first(problem):
    few = replace(SETTINGS, iterations=5)
    here = optimizer.optimize(problem, few)
    there = optimizer.optimize(problem, few, device="cuda")
    assert here.history == pytest.approx(there.history, rel=1e-3)
    assert (here.translation - there.translation).abs().max() < 1e-4
    assert abs(here.images - there.images).max() < 0.05


def test_while_it_plays_the_gpu_is_asked_nothing(problem):
    state = fresh(problem)
    optimizer.run(state, lambda step: step.iteration == 20)
    replay = state.replay[1]
    rows = torch.tensor([iteration._moment(SETTINGS, i) for i in range(21, 31)], dtype=torch.float32, device="cuda")
    torch.cuda.set_sync_debug_mode("error")
    try:
        for row in rows:
            replay._play(row, False)
    finally:
        torch.cuda.set_sync_debug_mode("default")


def test_a_search_that_finds_more_than_there_is_room_for_gets_more_room(problem):
    played, cramped = fresh(problem), fresh(problem)
    optimizer.run(played)
    optimizer.run(cramped, lambda step: step.iteration == 10)
    replay = cramped.replay[1]
    replay.capacity.sizes = {name: size // 3 for name, size in replay.capacity.sizes.items()}
    replay.records.clear()
    optimizer.run(cramped)
    assert replay.capacity.sizes["contour edges"] > 0
    assert played.losses()[:30] == pytest.approx(cramped.losses()[:30], rel=1e-2)


def test_settings_that_change_on_the_way_count(problem):
    state = fresh(problem)
    still = replace(SETTINGS, learning_rate=1e-12, final_learning_rate=1e-12, silhouette_weight=0.0)
    optimizer.run(state, lambda step: still if step.iteration == 40 else None)
    assert state.losses()[40, 1] > 0
    assert (state.losses()[41:, 1] == 0).all()
    assert state.losses()[-1, 3] == pytest.approx(state.losses()[45, 3], rel=1e-3)
