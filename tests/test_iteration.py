"""One iteration: it does what the loop says, and notes what it should."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from rasp_core.iteration import _moment, init, step
from rasp_core.optimizer import optimize, run
from rasp_core.poses import Poses
from rasp_core.problem import Settings

QUICK = Settings(iterations=20, query_points=5000, resolution=64)


def test_optimize_is_init_and_a_step_for_each_iteration(problem):
    start = Poses.random(problem.bodies, problem.container, QUICK.seed)
    state = init(problem, QUICK, start, problem.scene(viewing_volume=QUICK.viewing_volume))
    steps = [step(state) for _ in range(3)]
    assert [found.iteration for found in steps] == [0, 1, 2]
    assert torch.allclose(steps[0].rotation, start.rotation, atol=1e-6)
    assert not run(state)
    assert state.iteration == QUICK.iterations
    whole = optimize(problem, QUICK, start)
    assert torch.equal(state.variables.poses()[1].detach().double(), whole.translation)
    assert np.array_equal(torch.stack(state.history).numpy(), whole.history)
    assert (whole.bodies, whole.container) == (problem.bodies, problem.container)


def test_pulls_are_noted_every_tenth_iteration(problem):
    found = optimize(problem, Settings(iterations=21, query_points=2000, resolution=32))
    assert found.pulls.shape == (3, 4)
    assert (found.pulls[:, 0] > 0).all()
    assert found.pulls[0, 1] > 0, "random poses overlap"
    assert (found.pulls[:, 3] == 0).all()


def test_the_lattice_is_shifted_by_at_most_half_its_spacing_otherwise_each_time():
    shifts = np.array([_moment(replace(QUICK, seed=seed), i)[2:] for seed in range(3) for i in range(50)])
    assert np.abs(shifts).max() <= 0.5
    assert shifts.std(0) == pytest.approx(12**-0.5, abs=0.05)
    assert len(np.unique(shifts, axis=0)) == 150
    assert _moment(QUICK, 7) == _moment(QUICK, 7)
