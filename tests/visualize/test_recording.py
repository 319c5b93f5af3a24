"""Recordings against the runs that they are of."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh

from data_fetch import kitchen_like
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.containers import Container, box
from rasp_core.geometry.meshes import make_body
from rasp_core.optimizer import optimize, optimize_many
from rasp_core.poses import Poses
from rasp_core.problem import Problem, Settings
from rasp_core.util.errors import InputError
from rasp_core.visualize import recording
from rasp_core.visualize.recording import Recorder, Recording, record

QUICK = Settings(iterations=30, resolution=32, query_points=500)
BODIES, ROOM = kitchen_like(3), box((0.25, 0.25, 0.25))


@pytest.fixture(scope="module")
def recorded():
    return record(BODIES, ROOM, QUICK, lambdas=[0.1, 0.001], frames=10)


def test_a_run_is_the_same_bit_for_bit_when_it_is_recorded():
    alone = optimize(Problem(BODIES, ROOM), QUICK)
    watched = optimize(Problem(BODIES, ROOM), QUICK, callback=Recorder(BODIES, ROOM, frames=5))
    assert torch.equal(alone.rotation, watched.rotation)
    assert torch.equal(alone.translation, watched.translation)
    assert np.array_equal(alone.history, watched.history)


def test_frames_are_the_poses_of_their_iterations():
    steps, recorder = [], Recorder(BODIES, ROOM, frames=7)

    def both(step):
        recorder(step)
        steps.append((step.rotation.clone(), step.translation.clone(), step.losses.clone()))

    found = optimize(Problem(BODIES, ROOM), QUICK, callback=both)
    run = recorder.run(range(3), found.poses)
    assert run.iterations[0] == 0
    assert run.iterations[-1] == run.total == 30
    assert len(run.iterations) == 7
    assert set(np.diff(run.iterations)) <= {4, 5, 6}
    for frame, iteration in enumerate(run.iterations[:-1]):
        rotation, translation, losses = steps[iteration]
        assert np.array_equal(run.rotation[frame], rotation.double())
        assert np.array_equal(run.translation[frame], translation.double())
        assert np.array_equal(run.losses[frame], losses.double())
    assert np.array_equal(run.translation[-1], found.translation)
    assert np.array_equal(run.losses[-1], steps[-1][2].double())


def test_of_a_long_run_so_many_frames_are_kept_evenly():
    recorder = Recorder(BODIES[:1], ROOM, frames=10)
    for k in range(1000):
        recorder.watch([0], Poses(torch.eye(3)[None], torch.tensor([[float(k), 0, 0]])), torch.zeros(5))
        assert len(recorder._kept) <= 40
    run = recorder.run([0], Poses(torch.eye(3)[None], torch.tensor([[1000.0, 0, 0]])))
    assert run.iterations.tolist() == run.translation[:, 0, 0].tolist()
    assert run.iterations[-1] == 1000
    assert len(run.iterations) == 10
    steps = np.diff(run.iterations)
    assert steps.max() < 1.5 * steps.min()


def test_objects_come_and_go():
    recorder = Recorder(BODIES, ROOM)
    recorder.watch([2, 0], Poses(torch.eye(3).repeat(2, 1, 1), torch.tensor([[1.0, 2, 3], [4, 5, 6]])))
    run = recorder.run([1], Poses(torch.eye(3)[None], torch.zeros(1, 3)))
    assert run.present.tolist() == [[True, False, True], [False, True, False]]
    assert run.translation[0, 2].tolist() == [1, 2, 3]
    assert run.translation[0, 0].tolist() == [4, 5, 6]
    assert run.total == 0
    assert np.isnan(run.losses).all()


def test_overlap_is_the_share_that_is_filled_twice(two_balls):
    small = [body.scaled(0.1) for body in two_balls]
    recorder = Recorder(small, ROOM)
    stacked, apart = torch.zeros(2, 3), torch.tensor([[0.0, 0, 0], [9.0, 0, 0]])
    recorder.watch([0, 1], Poses(torch.eye(3).repeat(2, 1, 1), stacked))
    recorder.watch([1], Poses(torch.eye(3)[None], stacked[:1]))
    run = recorder.run([0, 1], Poses(torch.eye(3).repeat(2, 1, 1), apart))
    ball = 4 / 3 * np.pi * 0.1**3 / 0.25**3
    assert run.overlap[0] == pytest.approx(ball, rel=0.03)
    assert run.overlap[1:].tolist() == [0, 0]


def test_record_varies_lambda_and_epsilon(recorded):
    assert recorded.varied == {"lambda": [0.001, 0.1]}
    assert [run.values for run in recorded.runs] == [{"lambda": 0.1}, {"lambda": 0.001}]
    alone = optimize(Problem(BODIES, ROOM), replace(QUICK, lambda_=0.1))
    assert np.array_equal(recorded.runs[0].translation[-1], alone.translation)
    assert np.array_equal(recorded.runs[0].translation[0], recorded.runs[1].translation[0]), "they start alike"
    assert repr(recorded) == "<Recording of 3 objects, 20 frames, lambda 0.001, 0.1>"
    one = record(BODIES, ROOM, QUICK, epsilons=[0.002], frames=2)
    assert one.varied == {"epsilon (m)": [0.002]}
    assert one.cameras[0].width == 2 * 0.25


def test_a_container_of_many_views_shows_those_of_a_box():
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.2)
    views = recording.container_views(Container(make_body("ball", ball.vertices, ball.faces)))
    assert [(view.azimuth_deg, view.elevation_deg) for view in views] == [(0, 0), (90, 0), (0, 90)]


def test_save_writes_a_page_or_data(recorded, tmp_path):
    page, data = recorded.save(tmp_path / "run.html"), recorded.save(tmp_path / "run.json")
    assert json.loads(data.read_text()) == json.loads(json.dumps(recorded.encoded()))
    assert page.read_text().startswith("<!DOCTYPE html>")
    (tmp_path / "taken").mkdir()
    with pytest.raises(InputError, match=r"taken: cannot be written \(.*\); name another file"):
        recorded.save(tmp_path / "taken")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.html", "run.json", "taken"]


def test_wrong_recordings_are_refused(recorded):
    with pytest.raises(InputError, match="needs 2 frames or more, got 1"):
        record(BODIES, ROOM, QUICK, frames=1)
    starts = [Poses.random(BODIES, ROOM, seed) for seed in (0, 1)]
    with pytest.raises(InputError, match="of one start"):
        optimize_many(Problem(BODIES, ROOM), starts, QUICK, callback=Recorder(BODIES, ROOM))
    with pytest.raises(InputError, match="needs a run, got none"):
        Recording(BODIES, ROOM, [])
    with pytest.raises(InputError, match="each combination of lambda once"):
        record(BODIES, ROOM, QUICK, lambdas=[0.1, 0.1], frames=2)
    crossed = {"lambda": 1.0, "epsilon": 2.0}, {"lambda": 2.0, "epsilon": 1.0}
    runs = [replace(run, values=values) for run, values in zip(recorded.runs, crossed, strict=True)]
    with pytest.raises(InputError, match="each combination of lambda, epsilon once"):
        Recording(BODIES, ROOM, runs)
    for cameras in ([Camera(0, 0, 1.0, projection="perspective")], [Camera(k, 0, 1.0) for k in range(4)]):
        with pytest.raises(InputError, match="at most 3 shadows, all orthographic"):
            Recording(BODIES, ROOM, recorded.runs, cameras)
