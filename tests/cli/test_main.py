"""The command line as a user meets it: one line of result, one line of error, and its exit status."""

import os
import subprocess
import sys

import pytest
import trimesh

from rasp_core.cli import commands
from rasp_core.cli.main import main

BOX = "box:0.2,0.2,0.2"
SMALL = ["--iterations", "60", "--resolution", "64"]


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
def test_objects_that_cannot_be_used_are_named_in_one_line(cans, tmp_path, capsys, kind, says):
    out = tmp_path / "out"
    bad = broken(tmp_path, kind)
    assert main(["pack", str(cans), str(bad), "--container", BOX, "--out", str(out), *SMALL]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert error.startswith("rasp: ")
    assert says in error
    assert not out.exists()


@pytest.mark.parametrize(
    ("option", "value", "says"),
    [
        ("--container", "box:0,1,1", "write three positive edges"),
        ("--container", "box:1,-1,1", "write three positive edges"),
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
        ("--effort", "5", "method paper does not use effort (--effort)"),
        ("--device", "abacus", "device 'abacus' is not available"),
        ("--method", "magic", "unknown; use one of paper"),
        ("--out", "/dev/null/out", "cannot be written"),
        ("--lambda", "-1", "lambda_ must not be negative"),
    ],
)
def test_options_that_cannot_be_used_are_named_in_one_line(cans, tmp_path, capsys, option, value, says):
    arguments = ["pack", str(cans), "--container", BOX, "--out", str(tmp_path / "out"), *SMALL, option, value]
    try:
        status = main(arguments)
    except SystemExit as stopped:
        status = stopped.code
    assert status == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert says in error
    assert not (tmp_path / "out").exists()


def test_a_container_that_is_open_is_named(cans, tmp_path, capsys):
    assert main(["pack", str(cans), "--container", str(broken(tmp_path, "open")), "--out", str(tmp_path / "o")]) == 2
    assert "open.obj: the surface is open" in capsys.readouterr().err


def test_ctrl_c_before_anything_is_there_writes_nothing(monkeypatch, tmp_path, capsys):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("rasp_core.packing.from_files.load_bodies", interrupted)
    assert main(["pack", "x", "--container", BOX, "--out", str(tmp_path / "out")]) == 130
    assert "nothing was written" in capsys.readouterr().err


def test_ctrl_c_later_keeps_the_best_and_says_so(cans, monkeypatch, tmp_path, capsys):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("rasp_core.packing.dense._Search.grow", interrupted)
    pack = ["pack", str(cans), "--container", "box:0.1,0.1,0.1", "--repeat", "12", "--method", "dense", "--effort", "3"]
    assert main([*pack, "--out", str(tmp_path / "one")]) == 0
    assert "rasp: interrupted; this is the best until then" in capsys.readouterr().err
    assert main([*pack, "--boxes", "auto", "--out", str(tmp_path / "boxes")]) == 0
    assert "rasp: interrupted; this is the best until then" in capsys.readouterr().err


def test_letters_typed_where_the_locale_is_not_utf_8_are_letters(monkeypatch):
    """Python hands them on as escaped bytes there: the two of an umlaut had counted as two letters."""
    got = []
    monkeypatch.setattr(commands, "art", lambda options: got.append(options.text) or 0)
    escaped = "ÄB".encode().decode("ascii", "surrogateescape")
    assert main(["art", "parts", "--text", escaped, "Ö2"]) == 0
    assert got == [["ÄB", "Ö2"]]


def test_the_installed_command_prints_nothing_else(cans, tmp_path):
    """A real process: no traceback, no warnings of libraries, on either stream."""
    environment = {**os.environ, "PYTHONWARNINGS": "default"}
    command = [sys.executable, "-m", "rasp_core", "pack", str(cans), "--container", BOX, "--out", str(tmp_path / "o")]
    good = subprocess.run([*command, *SMALL], capture_output=True, text=True, env=environment)
    assert (good.returncode, good.stdout.count("\n")) == (0, 1)
    bad = subprocess.run([*command, "--count", "0"], capture_output=True, text=True, env=environment)
    assert (bad.returncode, bad.stdout, bad.stderr.count("\n")) == (2, "", 1)


@pytest.mark.parametrize(
    ("error", "says"),
    [(OSError(28, "No space left on device", "scene.glb"), "scene.glb: No space left"), (MemoryError(), "memory")],
)
def test_what_could_not_be_foreseen_is_said_in_a_line(error, says, cans, monkeypatch, capsys):
    def fails(*_, **__):
        raise error

    monkeypatch.setattr("rasp_core.packing.from_files.load", fails)
    assert main(["pack", str(cans), "--container", BOX]) == 2
    said = capsys.readouterr().err
    assert says in said
    assert said.count("\n") == 1


@pytest.mark.parametrize("option", ["--seed", "--resolution"])
@pytest.mark.parametrize("value", ["-1", "x", "1.5", "99999999999"])
def test_whole_numbers_within_bounds(option, value, cans, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["pack", str(cans), "--container", BOX, option, value])
    assert ended.value.code == 2
    assert "a whole number from" in capsys.readouterr().err


def test_a_container_that_is_closed_at_its_top_gives_nothing_out(cans, tmp_path, capsys):
    trimesh.creation.icosphere(radius=0.2).export(tmp_path / "ball.ply")
    command = ["pack", str(cans), "--container", str(tmp_path / "ball.ply"), "--method", "spectral", "--separable"]
    assert main([*command, "--out", str(tmp_path / "out")]) == 2
    assert "not one object can be pulled straight out" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_least_height_about_a_zone_is_told_and_checked(cans, tmp_path, capsys):
    post, out = tmp_path / "post.stl", tmp_path / "out"
    trimesh.creation.box((0.03, 0.03, 1.0)).export(post)  # half of it below the floor
    room = ["--container", "auto:0.2,0.2,*", "--keep-out", str(post)]
    assert main(["pack", str(cans), *room, "--effort", "3", "--out", str(out)]) == 0
    assert " in a box of 0.2 x 0.2 x " in capsys.readouterr().out
    assert main(["check", str(out)]) == 0
    assert main(["pack", str(cans), "--container", "auto", "--keep-out", str(post), "--out", str(out)]) == 2
    assert "name it, as in auto:0.3,0.2,*" in capsys.readouterr().err
