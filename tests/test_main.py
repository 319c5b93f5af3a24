"""The command line as a user meets it: one line of result, one line of error, and its exit status."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
import trimesh

from rasp_core.__main__ import main

BOX = "box:0.2,0.2,0.2"
SMALL = ["--iterations", "60", "--resolution", "64"]


@pytest.fixture
def pool(tmp_path):
    folder = tmp_path / "pool"
    folder.mkdir()
    for i in range(4):
        trimesh.creation.cylinder(0.02 + 0.005 * i, 0.05).export(folder / f"can{i}.stl")
    return folder


def test_pack_and_check_agree(pool, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["pack", str(pool), "--container", BOX, "--out", str(out), *SMALL]) == 0
    line = capsys.readouterr().out
    assert line.count("\n") == 1
    assert "certified" in line
    record = json.loads((out / "result.json").read_text())
    assert record["density"] == pytest.approx(record["density_voxels"], rel=0.03)
    assert record["seed"] == 0
    assert main(["check", str(out)]) == 0
    assert main(["check", str(out / "scene.glb")]) == 0
    assert f"density {record['density']:.4f}, certified" in capsys.readouterr().out


def test_the_smallest_box_is_found_and_judged(pool, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["pack", str(pool), "--container", "auto:0.15,0.15,*", "--effort", "3", "--out", str(out)]) == 0
    record = json.loads((out / "result.json").read_text())
    assert record["method"] == "dense"
    assert record["container"]["box"][:2] == [0.15, 0.15]
    assert len(record["objects"]) == 4
    assert main(["check", str(out)]) == 0


def test_a_packing_falls_and_comes_apart(pool, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["pack", str(pool), "--container", BOX, "--settle", "--out", str(out), *SMALL]) == 0
    printed = capsys.readouterr().err
    assert "rasp: settled" in printed
    assert "straight pulls" in printed
    record = json.loads((out / "result.json").read_text())
    assert record["settled"]["moved_max"] > 0.01, "three cans in 20 cm fall"
    assert len(record["removal"]["order"]) == len(record["objects"])
    assert main(["check", str(out / "settled.glb")]) == 0


def test_a_packing_that_does_not_hold_ends_with_status_1_and_says_what_fails(pool, tmp_path, capsys):
    crowd = ["--repeat", "40", "--count", "40", "--iterations", "3", "--resolution", "64"]
    assert main(["pack", str(pool), "--container", "box:0.1,0.1,0.1", "--out", str(tmp_path / "out"), *crowd]) == 1
    printed = capsys.readouterr()
    assert "NOT certified" in printed.out
    assert "overlap by" in printed.err
    assert main(["check", str(tmp_path / "out")]) == 1


def test_objects_are_scaled_to_a_container_of_its_own_units(pool, tmp_path):
    trimesh.creation.icosphere(radius=50).export(tmp_path / "ball.ply")
    out = tmp_path / "out"
    arguments = ["--container", str(tmp_path / "ball.ply"), "--repeat", "12", "--fit-objects", "20", "--out", str(out)]
    assert main(["pack", str(pool), *arguments, *SMALL]) == 0
    assert json.loads((out / "result.json").read_text())["object_scale"] > 100


def broken(path, kind):
    if kind == "missing":
        return path / "gone.obj"
    if kind == "empty folder":
        (path / "empty").mkdir()
        return path / "empty"
    file = path / f"{kind.replace(' ', '_')}.obj"
    if kind == "not a mesh":
        file = file.with_suffix(".png")
        file.write_bytes(b"\x89PNG")
    if kind == "text":
        file.write_text("hello")
    if kind == "open":
        file.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n")
    if kind == "nan":
        file.write_text("v 0 0 nan\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n")
    if kind == "no volume":
        flat = trimesh.creation.box((0.1, 0.1, 0.1))
        flat.vertices[:, 2] = 0
        file.write_text(trimesh.exchange.obj.export_obj(trimesh.Trimesh(flat.vertices, flat.faces, process=False)))
    if kind == "giant":
        trimesh.creation.box((1, 1, 1)).export(file)
    return file


@pytest.mark.parametrize(
    ("kind", "says"),
    [
        ("missing", "gone.obj: no such file"),
        ("empty folder", "empty: no mesh files"),
        ("not a mesh", "not_a_mesh.png: not a mesh file"),
        ("text", "text.obj: "),
        ("open", "open.obj: the surface is open"),
        ("nan", "nan.obj: has vertices that are NaN"),
        ("no volume", "no_volume.obj: encloses no volume"),
        ("giant", "giant: 1 x 1 x 1 m is larger than the container"),
    ],
)
def test_objects_that_cannot_be_used_are_named_in_one_line(pool, tmp_path, capsys, kind, says):
    out = tmp_path / "out"
    bad = broken(tmp_path, kind)
    assert main(["pack", str(pool), str(bad), "--container", BOX, "--out", str(out), *SMALL]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert error.startswith("rasp: ")
    assert says in error
    assert not out.exists()


@pytest.mark.parametrize(
    ("option", "value", "says"),
    [
        ("--container", "box:0,1,1", "box needs three positive edges"),
        ("--container", "box:1,-1,1", "box needs three positive edges"),
        ("--container", "box:1,1", "box:0.32,0.32,0.30"),
        ("--container", "gone.stl", "gone.stl: no such file"),
        ("--count", "0", "--count must be auto or a positive number, got 0"),
        ("--count", "many", "--count must be auto"),
        ("--count", "5", "count must lie between 1 and the 4 objects"),
        ("--repeat", "0", "1 to 100,000 objects can be drawn"),
        ("--fit-objects", "-1", "fitted"),
        ("--iterations", "0", "iterations must be positive"),
        ("--iterations", "ten", "invalid int value"),
        ("--time-limit", "0", "--time-limit must be positive"),
        ("--effort", "5", "method rasp has no effort"),
        ("--device", "abacus", "device 'abacus' is not available"),
        ("--method", "magic", "unknown; use one of rasp"),
        ("--out", "/dev/null/out", "cannot be written"),
        ("--lambda", "-1", "lambda_ must not be negative"),
    ],
)
def test_options_that_cannot_be_used_are_named_in_one_line(pool, tmp_path, capsys, option, value, says):
    arguments = ["pack", str(pool), "--container", BOX, "--out", str(tmp_path / "out"), *SMALL, option, value]
    try:
        status = main(arguments)
    except SystemExit as stopped:
        status = stopped.code
    assert status == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert says in error
    assert not (tmp_path / "out").exists()


def test_a_container_that_is_open_is_named(pool, tmp_path, capsys):
    assert main(["pack", str(pool), "--container", str(broken(tmp_path, "open")), "--out", str(tmp_path / "o")]) == 2
    assert "open.obj: the surface is open" in capsys.readouterr().err


def test_check_names_what_is_not_there(tmp_path, capsys):
    assert main(["check", str(tmp_path / "gone")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_figures_names_what_is_not_there(capsys):
    assert main(["figures", "99_gone"]) == 2
    assert "no figure named 99_gone" in capsys.readouterr().err


def test_ctrl_c_before_anything_is_there_writes_nothing(monkeypatch, tmp_path, capsys):
    def interrupted(_):
        raise KeyboardInterrupt

    monkeypatch.setattr("rasp_core.meshes.load_bodies", interrupted)
    assert main(["pack", "x", "--container", BOX, "--out", str(tmp_path / "out")]) == 130
    assert "nothing was written" in capsys.readouterr().err


def test_the_installed_command_prints_nothing_else(pool, tmp_path):
    """A real process: no traceback, no warnings of libraries, on either stream."""
    environment = {**os.environ, "PYTHONWARNINGS": "default"}
    command = [sys.executable, "-m", "rasp_core", "pack", str(pool), "--container", BOX, "--out", str(tmp_path / "o")]
    good = subprocess.run([*command, *SMALL], capture_output=True, text=True, env=environment)
    assert (good.returncode, good.stdout.count("\n")) == (0, 1)
    bad = subprocess.run([*command, "--count", "0"], capture_output=True, text=True, env=environment)
    assert (bad.returncode, bad.stdout, bad.stderr.count("\n")) == (2, "", 1)


def test_a_sweep_says_which_seed_packs_best_and_goes_on_where_it_ended(pool, tmp_path, capsys):
    out = tmp_path / "out"
    arguments = ["sweep", str(pool), "--container", BOX, "--seeds", "2", "--out", str(out), *SMALL]
    assert main([*arguments, "--lambda", "0.001", "0.002", "--workers", "1"]) == 0
    line = capsys.readouterr().out
    assert "4 runs, 4 certified; best density" in line
    assert len(list(out.glob("pack-*.json"))) == 4
    table = (out / "sweep.csv").read_text()
    assert table.splitlines()[0].startswith("lambda_,epsilon,seed,objects,density,certified")
    assert len(table.splitlines()) == 5
    assert main([*arguments, "--lambda", "0.001", "0.002", "--workers", "1"]) == 0
    assert (out / "sweep.csv").read_text() == table


@pytest.mark.parametrize(("option", "value"), [("--seeds", "0"), ("--workers", "0"), ("--time-limit", "-1")])
def test_a_sweep_refuses_what_it_cannot_do(pool, tmp_path, capsys, option, value):
    arguments = ["sweep", str(pool), "--container", BOX, "--out", str(tmp_path / "out"), *SMALL, option, value]
    assert main(arguments) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.real_data
@pytest.mark.parametrize(("group", "options"), [("kitchen", []), ("blockout", ["--repeat", "100"])])
def test_real_pools_are_packed_and_judged_by_booleans_of_the_scene_alone(data, tmp_path, group, options):
    """A short search in a quarter of IR-BPP's container; every node a rigid copy of its file, nothing overlapping."""
    out = tmp_path / "out"
    arguments = ["pack", str(data / group), "--container", "box:0.2,0.2,0.2", "--iterations", "300", "--out", str(out)]
    assert main([*arguments, *options]) == 0
    scene = trimesh.load_scene(out / "scene.glb")
    for node in set(scene.graph.nodes_geometry) - {"container"}:
        transform, geometry = scene.graph[node]
        assert transform[:3, :3] @ transform[:3, :3].T == pytest.approx(np.eye(3), abs=1e-6)
        original = trimesh.load_mesh(data / group / f"{node.split('#')[0]}.obj", process=False)
        assert scene.geometry[geometry].vertices == pytest.approx(original.vertices, abs=1e-6)
    assert main(["check", str(out)]) == 0


@pytest.mark.parametrize(
    ("error", "says"),
    [(OSError(28, "No space left on device", "scene.glb"), "scene.glb: No space left"), (MemoryError(), "memory")],
)
def test_what_could_not_be_foreseen_is_said_in_a_line(error, says, pool, monkeypatch, capsys):
    def fails(*_, **__):
        raise error

    monkeypatch.setattr("rasp_core.jobs.load", fails)
    assert main(["pack", str(pool), "--container", BOX]) == 2
    said = capsys.readouterr().err
    assert says in said
    assert said.count("\n") == 1


@pytest.mark.parametrize("option", ["--seed", "--resolution"])
@pytest.mark.parametrize("value", ["-1", "x", "1.5", "99999999999"])
def test_whole_numbers_within_bounds(option, value, pool, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["pack", str(pool), "--container", BOX, option, value])
    assert ended.value.code == 2
    assert "a whole number from" in capsys.readouterr().err
