"""The live run against `optimize` itself, and its commands."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest

from data_fetch import kitchen_like
from rasp_core.geometry.containers import box
from rasp_core.objective import LOSS_NAMES
from rasp_core.optimizer import optimize
from rasp_core.problem import Problem, Settings
from rasp_core.util.errors import InputError
from rasp_core.visualize import live as lives
from rasp_core.visualize.live import Controls, LiveRun

POOL, BOX = kitchen_like(5), box((0.2, 0.2, 0.2))
SETTINGS = Settings(iterations=25, query_points=5000, resolution=64)
CONTROLS = Controls(count=4)
EXTRUSION = LOSS_NAMES.index("extrusion")


@pytest.fixture
def live():
    run = LiveRun(POOL, BOX, CONTROLS, SETTINGS)
    run.frames = []
    run.watch = run.frames.append
    yield run
    run.close()


def test_run_to_the_end_is_what_arrange_gives(live):
    live.run()
    live.wait()
    expected = optimize(Problem(POOL[:4], BOX), replace(SETTINGS, lambda_=CONTROLS.lambda_))
    last = live.frames[-1]
    assert (last.matrices == expected.matrices).all()
    assert np.array_equal(last.history, expected.history)
    wide = Problem(POOL[:4], BOX).scene(viewing_volume=SETTINGS.viewing_volume)
    assert np.allclose(last.targets, wide.container_silhouettes(SETTINGS.resolution))
    assert last.certificate is not None
    assert live.frames[0].certificate is None


def test_run_goes_on_from_the_end_for_as_many_again(live):
    for done in (25, 50):
        live.run()
        live.wait()
        assert len(live.frames[-1].history) == done


def test_a_step_is_one_iteration(live):
    for done in (1, 2, 3):
        live.step()
        live.wait()
        assert len(live.frames[-1].history) == done


def test_a_change_acts_at_the_next_iteration(live):
    live.step()
    live.wait()
    live.change(lambda_=0.0)
    live.step()
    live.wait()
    live.change(lambda_=3.0)
    live.step()
    live.wait()
    extrusion = live.frames[-1].history[:, EXTRUSION]
    assert list(extrusion != 0) == [True, False, True]  # a term of weight 0 counts as 0


def test_pause_rests_and_run_goes_on(live):
    live.settings = replace(SETTINGS, iterations=100_000)
    live.run()
    live.pause()
    live.wait()
    before = len(live.frames[-1].history)
    assert before < 1000
    live.step()
    live.wait()
    assert len(live.frames[-1].history) == before + 1


def test_reset_and_another_seed_and_count_start_anew(live):
    live.step()
    live.wait()
    first = live.frames[0].matrices
    assert not np.array_equal(live.frames[-1].matrices, first) or len(live.frames[-1].history) == 1
    live.reset()
    live.wait()
    assert np.array_equal(live.frames[-1].matrices, first)
    assert len(live.frames[-1].history) == 0
    live.change(seed=1)
    live.wait()
    assert not np.array_equal(live.frames[-1].matrices, first)
    live.change(count=2)
    live.wait()
    assert len(live.frames[-1].matrices) == 2


def test_another_height_keeps_the_poses_and_lowers_the_targets(live):
    live.step()
    live.wait()
    live.change(height=0.5)
    live.wait()
    live.change(height=0.25)
    live.wait()
    half, quarter = live.frames[-2], live.frames[-1]
    assert np.array_equal(half.matrices, quarter.matrices)
    # the views are from two sides, where half of the height is half of the picture, and from above
    areas = quarter.targets.sum((1, 2)) / half.targets.sum((1, 2))
    assert np.allclose(sorted(areas), [0.5, 0.5, 1.0], atol=0.02)


def test_overlap_and_density_are_shares_of_the_container(live):
    for _ in range(4):  # by then all objects are inside
        live.run()
        live.wait()
    frame = live.frames[-1]
    volumes = sum(body.volume for body in POOL[:4]) / BOX.volume
    assert frame.density + frame.overlap == pytest.approx(volumes, rel=0.1)


@pytest.mark.parametrize("controls", [{"count": 0}, {"count": 6}, {"height": 0.0}, {"height": 1.5}, {"lambda_": -1.0}])
def test_controls_that_do_not_fit(live, controls):
    with pytest.raises(InputError, match=next(iter(controls))):
        live.change(**controls)
    with pytest.raises(InputError, match=next(iter(controls))):
        LiveRun(POOL, BOX, replace(CONTROLS, **controls), SETTINGS)


def test_what_the_watcher_raises_is_raised_by_wait(live):
    def watch(frame):
        raise RuntimeError("no screen")

    live.watch = watch
    live.run()
    with pytest.raises(RuntimeError, match="no screen"):
        live.wait()


def test_a_closed_run_stays_closed(live):
    live.step()
    live.wait()
    live.close()
    frames = len(live.frames)
    live.run()
    live.wait()
    assert len(live.frames) == frames


def test_controls_that_do_not_fit_change_nothing(live):
    with pytest.raises(InputError, match="count"):
        live.change(count=99, lambda_=1.0)
    assert live.controls == CONTROLS


def test_steps_go_past_the_end(live):
    live.settings = replace(SETTINGS, iterations=2)
    for done in (1, 2, 3):
        live.step()
        live.wait()
        assert len(live.frames[-1].history) == done
        assert (live.frames[-1].certificate is not None) == (done == 2), "the second is the last of two"


@pytest.mark.parametrize(("command", "rows"), [("run", 4), ("step", 3), ("reset", 0)])
def test_a_command_given_as_the_last_iteration_ends_is_obeyed(live, monkeypatch, command, rows):
    real, given = lives.optimize, []

    def ends(*problem, **more):
        done = real(*problem, **more)
        if not given:
            given.append(command)
            getattr(live, command)()
        return done

    monkeypatch.setattr(lives, "optimize", ends)
    live.settings = replace(SETTINGS, iterations=2)
    live.run()
    live.wait()
    assert len(live.frames[-1].history) == rows


def test_another_seed_in_the_last_iteration_is_run_to_its_end(live, monkeypatch):
    given = []
    live.settings = replace(SETTINGS, iterations=2)

    def after(step, real=live._after):
        if step.iteration == 1 and not given:
            given.append(step)
            live.change(seed=1)
        return real(step)

    monkeypatch.setattr(live, "_after", after)
    live.run()
    live.wait()
    expected = optimize(Problem(POOL[:4], BOX), replace(live.settings, lambda_=CONTROLS.lambda_, seed=1))
    assert np.array_equal(live.frames[-1].matrices, expected.matrices)


def test_the_watcher_may_close_the_run(live):
    live.watch = lambda frame: live.close()
    live.run()
    live.wait()  # raises what the thread has raised


def test_a_closed_run_is_given_back():
    run = LiveRun(POOL, BOX, CONTROLS, SETTINGS)
    run.step()
    run.wait()
    run.close()
    alive = weakref.ref(run)
    del run
    gc.collect()
    assert alive() is None
