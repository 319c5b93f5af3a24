"""Run folders: complete, readable by others, never half-written."""

import csv
import json
import os

import numpy as np
import pytest
import trimesh

from data_fetch import kitchen_like
from rasp_core.api import run_folder
from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import box
from rasp_core.geometry.meshes import unique_names
from rasp_core.optimizer import optimize
from rasp_core.problem import Problem, Settings
from rasp_core.util.errors import InputError
from rasp_core.visualize.gltf import read_scene

BOX = box((0.3, 0.3, 0.3))


@pytest.fixture(scope="module")
def run():
    bodies = kitchen_like(4)
    arrangement = optimize(
        Problem(unique_names([*bodies, bodies[0]]), BOX), Settings(iterations=5, query_points=1000, resolution=64)
    )
    return arrangement, certify(arrangement.problem.bodies, arrangement.matrices, BOX)


def test_a_runs_folder_holds_all_and_reads_back(run, tmp_path):
    arrangement, certificate = run
    folder = run_folder.save_run(tmp_path / "deep" / "run", arrangement, certificate, {"density": 0.5})
    assert sorted(f.name for f in folder.iterdir()) == ["history.csv", "result.json", "scene.glb", "silhouettes.png"]
    record = json.loads((folder / "result.json").read_text())
    assert record["density"] == 0.5
    assert record["certificate"]["holds"] == certificate.holds
    assert {"torch", "python", "open3d"} <= set(record["versions"])
    assert record["views"][2] == {
        "azimuth_deg": 0,
        "elevation_deg": 90,
        "width": pytest.approx(0.33),
        "centre": [0, 0, 0],
        "projection": "orthographic",
    }
    assert np.array([o["pose"] for o in record["objects"]]) == pytest.approx(arrangement.matrices)
    rows = list(csv.reader((folder / "history.csv").open()))
    assert rows[0] == ["iteration", "total", "silhouette", "overlap", "extrusion", "contact"]
    assert len(rows) == 6

    bodies, container = read_scene(folder)
    assert container.volume == pytest.approx(0.027)
    again = certify(bodies, np.tile(np.eye(4), (5, 1, 1)), container)
    assert again.overlap_volume == pytest.approx(certificate.overlap_volume, rel=1e-3, abs=1e-12)


def test_the_scene_is_plain_for_other_readers(run, tmp_path):
    arrangement, certificate = run
    folder = run_folder.save_run(tmp_path, arrangement, certificate, {})
    scene = trimesh.load_scene(folder / "scene.glb")
    assert set(scene.graph.nodes_geometry) == {*(b.name for b in arrangement.problem.bodies), "container"}
    assert "can_00#2" in scene.graph.nodes_geometry
    assert len(scene.geometry) == 5, "copies share their geometry"
    transform, geometry = scene.graph["can_00#2"]
    body = arrangement.problem.bodies[-1]
    placed = trimesh.transform_points(scene.geometry[geometry].vertices, transform)
    expected = trimesh.transform_points(body.vertices, arrangement.matrices[-1])
    assert placed.max(0) == pytest.approx(expected.max(0), abs=1e-6)


def test_a_folder_that_cannot_be_written_is_named(run, tmp_path):
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "deeper"):
        with pytest.raises(InputError, match="is a file"):
            run_folder.save_run(folder, *run, {})


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder_is_named(run, tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match="cannot be written"):
        run_folder.save_run(tmp_path / "out", *run, {})


def test_a_disk_that_fills_up_leaves_nothing(run, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(run_folder.os, "replace", full)
    with pytest.raises(InputError, match="No space left"):
        run_folder.save_run(tmp_path / "out", *run, {})
    assert list(tmp_path.iterdir()) == []


def test_a_path_that_no_one_may_write_is_named(tmp_path, monkeypatch):
    def denied(**_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(run_folder.tempfile, "TemporaryFile", denied)
    with pytest.raises(InputError, match="Permission denied"):
        run_folder.check_writable(tmp_path / "out")


def test_what_an_earlier_run_had_besides_goes_and_other_files_stay(run, tmp_path):
    poses = run[0].matrices
    run_folder.save_run(tmp_path, *run, {}, scenes={"settled.glb": poses}, pages={"load.html": "a"}, exports=["stl"])
    (tmp_path / "mine.txt").write_text("mine")
    record = json.loads((tmp_path / "result.json").read_text())
    assert {"scene.glb", "settled.glb", "load.html", "parts.stl"} <= set(record["files"])
    run_folder.save_run(tmp_path, *run, {}, pages={"run.html": "b"})
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"scene.glb", "history.csv", "silhouettes.png", "result.json", "run.html", "mine.txt"}
    for strange in ("{", "[]", '{"files": 3}', '{"files": [3, "..", "."]}'):  # cut short, or another's
        (tmp_path / "result.json").write_text(strange)
        run_folder.save_run(tmp_path, *run, {})
        assert (tmp_path / "run.html").exists(), "whose it is, nobody knows"
