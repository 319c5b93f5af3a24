"""Run folders: complete, readable by others, never half-written."""

import base64
import csv
import io
import json
import os
import re

import numpy as np
import pytest
import trimesh

from data_fetch import kitchen_like
from rasp_core import results
from rasp_core.arrange import arrange
from rasp_core.certify import certify
from rasp_core.containers import box
from rasp_core.errors import InputError
from rasp_core.meshes import unique_names
from rasp_core.problem import Problem, Settings

BOX = box((0.3, 0.3, 0.3))


@pytest.fixture(scope="module")
def run():
    bodies = kitchen_like(4)
    arrangement = arrange(
        Problem(unique_names([*bodies, bodies[0]]), BOX), Settings(iterations=5, query_points=1000, resolution=64)
    )
    return arrangement, certify(arrangement.problem.bodies, arrangement.matrices, BOX)


def test_a_runs_folder_holds_all_and_reads_back(run, tmp_path):
    arrangement, certificate = run
    folder = results.save_run(tmp_path / "deep" / "run", arrangement, certificate, {"density": 0.5})
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

    bodies, container = results.read_scene(folder)
    assert container.volume == pytest.approx(0.027)
    again = certify(bodies, np.tile(np.eye(4), (5, 1, 1)), container)
    assert again.overlap_volume == pytest.approx(certificate.overlap_volume, rel=1e-3, abs=1e-12)


def test_the_scene_is_plain_for_other_readers(run, tmp_path):
    arrangement, certificate = run
    folder = results.save_run(tmp_path, arrangement, certificate, {})
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
            results.save_run(folder, *run, {})


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder_is_named(run, tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match="cannot be written"):
        results.save_run(tmp_path / "out", *run, {})


def test_a_disk_that_fills_up_leaves_nothing(run, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(results.os, "replace", full)
    with pytest.raises(InputError, match="No space left"):
        results.save_run(tmp_path / "out", *run, {})
    assert list(tmp_path.iterdir()) == []


def test_a_path_that_no_one_may_write_is_named(tmp_path, monkeypatch):
    def denied(**_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(results.tempfile, "TemporaryFile", denied)
    with pytest.raises(InputError, match="Permission denied"):
        results.check_writable(tmp_path / "out")


def test_scenes_that_cannot_be_used_are_named(tmp_path):
    with pytest.raises(InputError, match="no such scene"):
        results.read_scene(tmp_path / "gone.glb")
    (tmp_path / "bad.glb").write_bytes(b"glTF nonsense")
    with pytest.raises(InputError, match="rasp pack writes scenes"):
        results.read_scene(tmp_path / "bad.glb")
    cube, sheet = trimesh.creation.box(), trimesh.Trimesh(np.eye(3), [[0, 1, 2]])

    def scene(name, **nodes):
        made = trimesh.Scene()
        for node, mesh in nodes.items():
            made.add_geometry(mesh, node_name=node, geom_name=node)
        made.export(tmp_path / name)
        return tmp_path / name

    with pytest.raises(InputError, match="no node named container"):
        results.read_scene(scene("a.glb", thing=cube))
    with pytest.raises(InputError, match="no objects"):
        results.read_scene(scene("b.glb", container=cube))
    with pytest.raises(InputError, match=r"c\.glb: thing: .*open"):
        results.read_scene(scene("c.glb", thing=sheet, container=cube))


def test_a_page_holds_all_that_it_needs():
    bodies, matrices = kitchen_like(2), np.tile(np.eye(4), (2, 1, 1))
    text = results.page(bodies, matrices)
    assert not re.search(r'(src|href)="', text), "nothing is loaded from elsewhere"
    data = max(re.findall(r"[A-Za-z0-9+/=]{1000,}", text), key=lambda word: word.startswith("Z2xURg"))
    scene = trimesh.load_scene(io.BytesIO(base64.b64decode(data)), file_type="glb")
    assert set(scene.geometry) == {body.name for body in bodies}
    high = max(np.ptp(body.solid_vertices[:, 2]) for body in bodies)
    assert np.ptp(scene.bounds[:, 1]) >= 0.99 * high, "up is y in a page"
    frame = results.page(bodies, matrices, embedded=True)
    assert frame.startswith("<div><iframe srcdoc=")
