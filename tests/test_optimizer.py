"""The loop: it does what the losses say, repeats itself, stops and resumes."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from data_fetch import kitchen_like
from rasp_core.exact.certificate import certify
from rasp_core.geometry import containers
from rasp_core.kernels import dispatch
from rasp_core.objective import LOSS_NAMES
from rasp_core.optimizer import optimize, optimize_many
from rasp_core.poses import Poses
from rasp_core.problem import Problem, Settings
from rasp_core.util.errors import InputError

BOX = containers.box((0.3, 0.3, 0.3))  # of `problem`, too
QUICK = Settings(iterations=20, query_points=5000, resolution=64)


def test_overlapping_bodies_are_separated_inside_the_box(problem):
    settings = replace(QUICK, iterations=150, lambda_=1.0, contact_weight=1.0, contact_margin=1e-4, query_points=20_000)
    start = Poses.random(problem.bodies, BOX, 0)
    start = Poses(start.rotation, 0.3 * start.translation)
    before = optimize(problem, replace(settings, iterations=1, learning_rate=1e-9, final_learning_rate=1e-9), start)
    after = optimize(problem, settings, start)
    assert not certify(problem.bodies, before.matrices, BOX).holds
    assert certify(problem.bodies, after.matrices, BOX).holds


@pytest.mark.parametrize("several", [False, True])
def test_obstacles_stay_and_the_others_are_pressed_off_them(two_balls, several):
    room = containers.box((20, 20, 20))
    start = Poses(torch.eye(3).repeat(2, 1, 1), torch.tensor([[0.0, 0, 0], [1.0, 0.2, 0.1]]))
    settings = replace(QUICK, iterations=100, silhouette_weight=0, overlap_weight=0, lambda_=1, contact_weight=1)
    problem = Problem(two_balls, room, obstacles=1)
    runs = optimize_many(problem, [start, start], settings) if several else [optimize(problem, settings, start)]
    for found in runs:
        assert torch.equal(found.translation[1], start.translation[1].double())
        assert torch.equal(found.rotation[1], start.rotation[1].double())
        assert (found.translation[0] - found.translation[1]).norm() > 1.95


def test_silhouettes_alone_bring_a_body_onto_its_target(two_balls):
    room = containers.box((6, 6, 6))
    settings = Settings(iterations=150, resolution=64, overlap_weight=0, lambda_=0, learning_rate=2e-2)
    still = Poses(torch.eye(3)[None], torch.zeros(1, 3))
    aim = optimize(Problem(two_balls[:1], room), replace(settings, iterations=1, learning_rate=1e-9), still)
    off = Poses(torch.eye(3)[None], torch.tensor([[0.9, -0.7, 0.8]]))
    found = optimize(Problem(two_balls[:1], room, targets=aim.images), settings, off)
    assert found.translation.norm() < 0.05


@pytest.mark.parametrize("rotation", ["angles", "quaternion"])
def test_equal_runs_are_equal_bit_for_bit_and_seeds_differ(problem, rotation):
    settings = replace(QUICK, rotation=rotation)
    first, second = optimize(problem, settings), optimize(problem, settings)
    assert torch.equal(first.rotation, second.rotation)
    assert torch.equal(first.translation, second.translation)
    assert np.array_equal(first.history, second.history)
    assert not torch.equal(first.translation, optimize(problem, replace(settings, seed=1)).translation)


def test_both_parametrisations_stay_rigid(problem):
    for rotation in ("angles", "quaternion"):
        turns = optimize(problem, replace(QUICK, rotation=rotation)).rotation
        assert (turns @ turns.transpose(1, 2) - torch.eye(3)).abs().max() < 1e-5
        assert (torch.linalg.det(turns) > 0).all()


def test_the_callback_sees_every_iteration_and_can_stop(problem):
    seen = []
    stopped = optimize(problem, QUICK, callback=lambda step: seen.append(step) or step.iteration == 4)
    assert [step.iteration for step in seen] == [0, 1, 2, 3, 4]
    assert stopped.interrupted
    assert stopped.history.shape == (5, len(LOSS_NAMES))
    assert seen[0].images.shape == (3, 64, 64)


def test_ctrl_c_returns_what_there_is(problem):
    def interrupt(step):
        if step.iteration == 3:
            raise KeyboardInterrupt

    stopped = optimize(problem, QUICK, callback=interrupt)
    assert stopped.interrupted
    assert len(stopped.history) == 4
    assert torch.equal(stopped.translation, optimize(problem, QUICK, callback=lambda s: s.iteration == 3).translation)


def test_a_resumed_run_ends_as_an_undisturbed_one(problem, tmp_path):
    settings = replace(QUICK, contact_weight=1.0, contact_margin=1e-4)
    whole = optimize(problem, settings)
    path = tmp_path / "state.pt"
    optimize(problem, settings, checkpoint=path, callback=lambda step: step.iteration == 9)
    resumed = optimize(problem, settings, checkpoint=path)
    assert torch.equal(whole.rotation, resumed.rotation)
    assert torch.equal(whole.translation, resumed.translation)
    assert np.array_equal(whole.history, resumed.history)
    assert [file.name for file in tmp_path.iterdir()] == ["state.pt"]


def test_progress_names_the_losses(problem, capsys):
    optimize(problem, QUICK, progress=True)
    printed = capsys.readouterr().err
    assert all(name in printed for name in ("arrange", "overlap=", "silhouette="))


def test_matrices_place_the_files_own_vertices(problem):
    found = optimize(problem, QUICK)
    for body, matrix, turn, place in zip(
        problem.bodies, found.matrices, found.rotation, found.translation, strict=True
    ):
        expected = (body.vertices - body.centre) @ turn.numpy().T + place.numpy()
        assert body.vertices @ matrix[:3, :3].T + matrix[:3, 3] == pytest.approx(expected, abs=1e-12)


def test_starts_and_targets_that_do_not_fit_are_refused(problem):
    with pytest.raises(InputError, match="2 poses for 6 objects"):
        optimize(problem, QUICK, Poses(torch.eye(3).repeat(2, 1, 1), torch.zeros(2, 3)))
    with pytest.raises(InputError, match="64 x 64"):
        optimize(replace(problem, targets=np.zeros((3, 32, 32))), QUICK)
    with pytest.raises(InputError, match="no start"):
        optimize_many(problem, [], QUICK)


@pytest.mark.parametrize("name", dispatch.ENGINES)
def test_many_starts_at_once_are_each_as_alone(name):
    """All terms, contact included; 5 objects, 3 starts."""
    problem = Problem(kitchen_like(5), BOX)
    settings = replace(QUICK, iterations=12, contact_weight=1.0, lambda_=3.0)
    starts = [Poses.random(problem.bodies, problem.container, seed) for seed in range(3)]
    with dispatch.use(name):
        together = optimize_many(problem, starts, settings)
        alone = [optimize(problem, settings, start) for start in starts]
    for one, other in zip(together, alone, strict=True):
        assert (one.translation - other.translation).abs().max() < 1e-5
        assert (one.rotation - other.rotation).abs().max() < 1e-4
        assert one.history.shape == (12, 5)
        assert np.allclose(one.history, other.history, rtol=1e-3, atol=1e-6)
        assert np.abs(one.images - other.images).max() < 1e-2


def test_many_starts_go_on_from_a_checkpoint(tmp_path):
    problem, path = Problem(kitchen_like(2), BOX), tmp_path / "state.pt"
    settings = replace(QUICK, iterations=8)
    starts = [Poses.random(problem.bodies, problem.container, seed) for seed in range(2)]
    whole = optimize_many(problem, starts, settings)
    optimize_many(problem, starts, settings, checkpoint=path, callback=lambda step: step.iteration == 4)
    resumed = optimize_many(problem, starts, settings, checkpoint=path)
    assert all(torch.equal(a.translation, b.translation) for a, b in zip(whole, resumed, strict=True))
    assert resumed[1].history.shape == (8, 5)


def test_settings_from_the_callback_take_over(problem):
    settings = replace(QUICK, iterations=4, lambda_=1.0)
    found = optimize(problem, settings, callback=lambda _: replace(settings, lambda_=0.0, resolution=7))
    assert list(found.history[:, LOSS_NAMES.index("extrusion")] != 0) == [True, False, False, False]
    assert found.images.shape[-1] == settings.resolution
    assert not found.interrupted


@pytest.mark.parametrize(("viewing_volume", "comes_back"), [(1.1, False), (3.0, True)])
def test_shadows_pull_back_what_is_out_of_the_box_but_in_the_picture(viewing_volume, comes_back):
    """One can beside the box; walls do not pull."""
    bodies = kitchen_like(1)
    start = Poses(torch.eye(3)[None], torch.tensor([[0.25, 0.0, 0.0]]))
    settings = Settings(iterations=100, resolution=64, lambda_=0.0, viewing_volume=viewing_volume, softness_px=16.0)
    run = optimize(Problem(bodies, BOX), settings, start)
    assert (run.translation[0, 0] < 0.15) == comes_back
    assert run.cameras[0].width == pytest.approx(1.1 * 0.3), "drawn close about the container all the same"
