"""Assembly of broken vessels against where their parts were cut out."""

import json

import numpy as np
import pytest
import torch
import trimesh
from PIL import Image

from data_fetch import fracture, scatter, vessels
from rasp_core.assembly import metrics
from rasp_core.assembly.assemble import assemble, assemble_by_silhouettes
from rasp_core.cli.main import main
from rasp_core.geometry.cameras import box_views
from rasp_core.geometry.containers import Container
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.silhouette_edges import Outlines, Views
from rasp_core.silhouettes import render, render_at_rest
from rasp_core.util.errors import InputError


@pytest.mark.parametrize(("which", "count"), [(0, 2), (2, 2), (3, 3)])
def test_scattered_parts_come_back(which, count):
    whole = vessels()[which]
    parts = fracture(whole, count, seed=1)
    moved, truth = scatter(parts)
    found = assemble(moved, Container(whole), seed=0)
    assert metrics.measure(moved, found.matrices, truth).parts == 1
    assert found.scores.min() > 0.7
    assert list(found.warnings) == []
    assert list(found.bodies) == moved
    assert found.poses.rotation.shape == (count, 3, 3)
    assert found.certificate.overlap_volume < 0.01 * whole.volume


def test_one_part_alone():
    whole = vessels()[1]
    with pytest.raises(InputError, match="at least two parts, got 1"):
        assemble([whole], Container(whole))


def test_parts_of_something_larger():
    whole = vessels()[1]
    with pytest.raises(InputError, match=r"1\.5\d times the whole's volume"):
        assemble([part.scaled(1.16) for part in fracture(whole, 2)], Container(whole))


def test_a_part_that_fits_nowhere():
    whole = vessels()[1]
    rod = trimesh.creation.box((0.4, 0.004, 0.004))
    with pytest.raises(InputError, match="rod fits nowhere"):
        assemble([make_body("rod", rod.vertices, rod.faces)] * 2, Container(whole))


def test_a_missing_part_is_said():
    whole = vessels()[3]
    found = assemble(fracture(whole, 3, seed=1)[:2], Container(whole))
    assert "are all there" in found.warnings[0]


def test_the_command_writes_a_run_and_says_how_well(tmp_path, capsys):
    whole = vessels()[3]
    mesh = trimesh.Trimesh(whole.solid_vertices, whole.solid_faces, process=False)
    mesh.export(tmp_path / "whole.ply")
    (tmp_path / "parts").mkdir()
    for body in scatter(fracture(whole, 2, seed=1))[0]:
        trimesh.Trimesh(body.vertices, body.faces, process=False).export(tmp_path / "parts" / f"{body.name}.ply")
    arguments = ["assemble", str(tmp_path / "parts"), "--whole", str(tmp_path / "whole.ply"), "--out"]
    assert main([*arguments, str(tmp_path / "run")]) == 0
    scores = list(json.loads((tmp_path / "run" / "result.json").read_text())["scores"].values())
    assert min(scores) > 0.7  # graded by distance, and edges count for less
    assert f"2 parts, fit of their surfaces: {np.mean(scores):.1%} in the mean" in capsys.readouterr().out
    assert {"scene.glb", "result.json", "silhouettes.png"} <= {path.name for path in (tmp_path / "run").iterdir()}


def test_the_command_takes_silhouettes(tmp_path, capsys):
    whole = vessels()[2]
    cameras = box_views(0.25, (0, 0, 0))
    place = torch.eye(3)[None], torch.zeros(1, 3)
    images = render(Outlines([whole]), *place, Views(cameras), 256).numpy()
    for k, image in enumerate(images):
        Image.fromarray((255 * (1 - image)).astype(np.uint8)).save(tmp_path / f"{k}.png")
    (tmp_path / "parts").mkdir()
    parts = fracture(whole, 2, seed=1)
    moved, truth = scatter(parts)
    for body in moved:
        trimesh.Trimesh(body.vertices, body.faces, process=False).export(tmp_path / "parts" / f"{body.name}.ply")
    pictures = [str(tmp_path / f"{k}.png") for k in range(3)]
    arguments = ["assemble", str(tmp_path / "parts"), "--silhouettes", *pictures, "--out", str(tmp_path / "run")]
    assert main([*arguments, "--width", "0.25"]) == 0
    record = json.loads((tmp_path / "run" / "result.json").read_text())
    found = np.array([entry["pose"] for entry in record["objects"]])
    assert metrics.measure(moved, found, truth).parts == 1
    assert min(record["likeness"]) > 0.95
    assert f"2 parts, likeness: {np.mean(record['likeness']):.1%} in the mean" in capsys.readouterr().out
    assert main(arguments) == 2
    assert capsys.readouterr().err.startswith("rasp: silhouettes need the pictures' width in metres; give --width")
    assert main([*arguments[:3], *pictures[:2], "--width", "0.25", "--out", str(tmp_path / "other")]) == 2
    assert "got 3 and 3 for 2 pictures" in capsys.readouterr().err


def test_silhouettes_that_do_not_come_out_alike_are_said():
    whole = vessels()[3]
    cameras = box_views(0.3, whole.centre)
    images = render_at_rest(whole, Views(cameras), 128).numpy()
    part = fracture(whole, 3, seed=1)[:2]
    found = assemble_by_silhouettes(part, images, cameras)
    assert any("is like the given one by" in line for line in found.warnings)


def test_the_command_refuses_what_is_not_a_broken_thing(tmp_path, capsys):
    mesh = trimesh.creation.box((0.1, 0.1, 0.1))
    mesh.export(tmp_path / "whole.ply")
    arguments = ["assemble", str(tmp_path / "whole.ply"), "--whole", str(tmp_path / "whole.ply"), "--out"]
    assert main([*arguments, str(tmp_path / "run")]) == 2
    assert capsys.readouterr().err == "rasp: assembly needs at least two parts, got 1\n"
    assert not (tmp_path / "run").exists()


def test_another_unit_is_told_at_once(tmp_path):
    whole = vessels()[0]
    parts = [part.scaled(1e-3) for part in fracture(whole, 2, seed=0)]
    with pytest.raises(InputError, match=r"lengths look 0\.001 times the whole's"):
        assemble(parts, Container(whole))
    with pytest.raises(InputError, match=r"lengths look 1e\+03 times the whole's"):
        assemble([part.scaled(1e6) for part in parts], Container(whole))
