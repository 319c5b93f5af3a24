"""Heaps judged by rays and by exact booleans, not by the renderer that made them."""

import json
import shutil

import numpy as np
import pytest
import torch
import trimesh
from oracles import cast_mask, read_letters
from PIL import Image

from data_fetch import kitchen_like
from rasp_core.art import anamorphic
from rasp_core.art.glyphs import letters
from rasp_core.art.greedy_cover import Covering
from rasp_core.cli.main import main
from rasp_core.exact.certificate import certify
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.containers import box
from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.poses import Poses, file_to_world
from rasp_core.silhouettes import likeness
from rasp_core.util.errors import InputError
from rasp_core.visualize.gltf import read_scene

SIDES = [Camera(0, 0, 1.0), Camera(90, 0, 1.0)]


@pytest.fixture(scope="module")
def made():
    pictures = letters(["C", "2"], 192)[0]
    return anamorphic.sculpt(kitchen_like(60), pictures, SIDES, seed=0)


def test_rays_see_the_pictures_and_booleans_no_overlap(made):
    rotation, translation = made.poses.rotation, made.poses.translation
    images = np.stack([cast_mask(made.bodies, rotation, translation, camera, 192) for camera in made.cameras])
    assert likeness(images, made.hull).min() > 0.93
    assert made.of_ceiling.min() == pytest.approx(likeness(images, made.hull).min(), abs=0.005)
    assert certify(made.bodies, made.matrices, made.container).holds
    assert made.certificate.holds
    assert len(made.rounds) >= 1
    assert len(made.arrangement.history) > 0, "the paper's loss was used"


@pytest.mark.skipif(shutil.which("tesseract") is None, reason="tesseract is not installed; .ci/run installs it")
def test_letters_are_read(made):
    assert [read_letters([image > 0.5]) for image in made.arrangement.images] == ["C", "2"]


def test_what_cannot_be_made():
    square = np.zeros((32, 32), bool)
    square[8:24, 8:24] = True
    two = np.stack([square] * 2)
    with pytest.raises(InputError, match="nothing to arrange"):
        anamorphic.sculpt([], two, SIDES)
    with pytest.raises(InputError, match="not one of the objects could be placed"):
        anamorphic.sculpt(kitchen_like(3), two, SIDES, width=0.02)
    with pytest.raises(InputError, match="at least one object, got a count of 0"):
        anamorphic.sculpt(kitchen_like(3), two, SIDES, count=0)
    with pytest.raises(InputError, match=r"width must be positive, got 0\.0"):
        anamorphic.sculpt(kitchen_like(3), two, SIDES, width=0.0)
    with pytest.raises(InputError, match=r"\(2, 32, 32\) need colours \(\.\.\., 3\), got \(2, 16, 16, 3\)"):
        anamorphic.sculpt(kitchen_like(3), two, SIDES, colours=np.ones((2, 16, 16, 3)))


def test_time_and_count_are_kept():
    pictures = letters(["C", "2"], 96)[0]
    found = anamorphic.sculpt(kitchen_like(10), pictures, SIDES, count=5, time_limit=1e-3)
    assert len(found.bodies) <= 5
    assert len(found.rounds) == 1


@pytest.fixture
def squares(tmp_path):
    """Two pictures of a square, blue and orange, and a folder of objects."""
    for name, colour in (("a", (40, 80, 200)), ("b", (250, 160, 40))):
        pixels = np.full((96, 96, 3), 255, np.uint8)
        pixels[20:-20, 20:-20] = colour
        Image.fromarray(pixels).save(tmp_path / f"{name}.png")
    (tmp_path / "objects").mkdir()
    for body in kitchen_like(8):
        mesh = trimesh.Trimesh(body.vertices, body.faces, process=False)
        mesh.export(tmp_path / "objects" / f"{body.name}.ply")
    return tmp_path


def test_the_command_paints_and_writes_a_run(squares, capsys):
    arguments = ["art", str(squares / "objects"), "--targets", str(squares / "a.png"), str(squares / "b.png")]
    limits = ["--resolution", "96", "--width", "0.9", "--count", "40", "--paint", "--out", str(squares / "run")]
    assert main([*arguments, *limits]) == 0
    printed = capsys.readouterr()
    assert "2 views, likeness" in printed.out
    assert "rasp: painted, PSNR" in printed.err
    record = json.loads((squares / "run" / "result.json").read_text())
    assert [view["azimuth_deg"] for view in record["views"]] == [0, 90]
    assert len(record["psnr"]) == len(record["likeness"]) == len(record["ceiling"]) == 2
    assert min(record["likeness_of_ceiling"]) > 0.8
    bodies, container = read_scene(squares / "run")
    assert certify(bodies, np.tile(np.eye(4), (len(bodies), 1, 1)), container).holds
    files = {path.name for path in (squares / "run").iterdir()}
    assert {"scene.glb", "painted.png", "target_1.png", "target_2.png", "silhouettes.png", "history.csv"} <= files


def test_the_command_makes_a_heap_for_each_place_in_words(squares, capsys):
    limits = ["--resolution", "64", "--width", "0.4", "--count", "3", "--pictures", "--out", str(squares / "words")]
    building = ["--build", "--printer", "90,90,120", "--thickness", "1"]
    assert main(["art", str(squares / "objects"), "--text", "I", "12", *limits, *building]) == 0
    assert "built.stl: one closed piece of " in capsys.readouterr().out
    assert (squares / "words" / "1" / "result.json").exists()
    files = {path.name for path in (squares / "words" / "2").iterdir()}
    assert {"scene.glb", "installation.png", "turntable.gif", "heap.html", "built.stl", "built.3mf"} <= files
    with Image.open(squares / "words" / "2" / "turntable.gif") as film:
        assert film.n_frames == 36


def test_the_command_hangs_a_heap_up(squares, capsys):
    limits = ["--resolution", "64", "--width", "0.4", "--count", "3", "--out", str(squares / "hung")]
    assert main(["art", str(squares / "objects"), "--text", "I", "1", *limits, "--hang", "--thread", "0.1"]) == 0
    assert "hung.3mf: 3 objects on 6 threads of 0.1 mm" in capsys.readouterr().out
    assert {"hung.3mf", "threads.csv"} <= {path.name for path in (squares / "hung").iterdir()}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--targets", "blank.png", "a.png"], "blank.png: is blank"),
        (["--targets", "a.png"], "two to four views, got 1"),
        (["--targets", "a.png", "b.png", "--azimuths-deg", "30", "30"], "two views look along one line"),
        (["--targets", "a.png", "b.png", "--azimuths-deg", "0", "180"], "two views look along one line"),
        (["--targets", "a.png", "b.png", "--azimuths-deg", "0"], "each of 2 pictures needs an azimuth"),
        (["--targets", "a.png", "text.png"], "text.png: cannot be read as a picture"),
        (["--targets", "a.png", "none.png"], "none.png: no such picture"),
        (["--text", "A", "\U00012000"], "the font has no letter"),
        (["--text", "AB", ""], "words need a letter at least"),
        (["--text", "A", "B", "--paint"], "letters have no colours"),
        (["--text", "A", "B", "--resolution", "4"], "resolution must be at least 32, got 4"),
        (["--text", "A", "B", "--count", "0"], "needs at least one object, got a count of 0"),
        (["--text", "A", "B", "--time-limit", "0"], "--time-limit must be positive"),
        (["--text", "A", "B", "--width", "-1"], "width must be positive"),
        (["--text", "A", "B", "--thickness", "1"], "--thickness is of a piece to build; add --build"),
        (["--text", "A", "B", "--build", "--printer", "9,9,0"], "three positive lengths in mm"),
        (
            ["--text", "A", "B", "--hang", "--thread", "9"],
            "threads must be thicker than 0 and thinner than a hundredth",
        ),
    ],
)
def test_the_command_refuses_in_one_line(squares, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(squares)
    Image.fromarray(np.full((20, 20), 255, np.uint8)).save("blank.png")
    (squares / "text.png").write_text("no picture")
    assert main(["art", "objects", *arguments, "--out", "run"]) == 2
    printed = capsys.readouterr().err.strip().splitlines()
    assert len(printed) == 1
    assert message in printed[0]
    assert not (squares / "run").exists()


def test_a_heap_that_cannot_be_built_leaves_nothing_behind(squares, capsys):
    small = ["--count", "1", "--width", "0.4", "--resolution", "32", "--out", str(squares / "run")]
    below = ["--elevations-deg", "0", "-60", "--build"]
    assert main(["art", str(squares / "objects"), "--text", "A", "B", *below, *small]) == 2
    assert "a base would stand before the view at azimuth 90, elevation -60" in capsys.readouterr().err
    assert not (squares / "run").exists()


@pytest.mark.parametrize(("apart", "left"), [(0.02, 1), (0.1995, 2), (0.3, 2)])
def test_what_overlaps_is_separated_or_taken_out(apart, left):
    mesh = trimesh.creation.icosphere(3, 0.1)
    covering = Covering([make_body("ball", mesh.vertices, mesh.faces)], SIDES, np.ones((2, 64, 64)), seed=0)
    places = torch.tensor([[-apart / 2, 0, 0], [apart / 2, 0, 0]], dtype=torch.float64)
    covering.set_bodies([0, 0], Poses(torch.eye(3, dtype=torch.float64).repeat(2, 1, 1), places))
    anamorphic._remove_overlaps(covering)
    assert len(covering.chosen) == left
    bodies = unique_names([covering.pool[i] for i in covering.chosen])
    matrices = file_to_world(bodies, covering.poses.rotation, covering.poses.translation)
    assert certify(bodies, matrices, box([1.0] * 3)).holds


def test_few_painted_objects_may_make_a_small_picture():
    """Painted pictures are wide, so that small objects can hide what is disputed; few objects do not cover these."""
    disc = np.hypot(*(np.mgrid[:64, :64] - 31.5)) < 24
    colours = np.where(disc[..., None], np.array([0.2, 0.4, 0.8]), 1.0)
    found = anamorphic.sculpt(kitchen_like(6), np.stack([disc, disc]), SIDES, count=20, colours=np.stack([colours] * 2))
    assert found.likeness.min() > 0.85
