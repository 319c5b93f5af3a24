"""What the commands of the command line do, and the folders that they leave; see `test_main` for errors of input."""

import json

import manifold3d
import numpy as np
import pytest
import trimesh

from rasp_core.cli.main import main
from tests import judge

BOX = "box:0.2,0.2,0.2"
SMALL = ["--iterations", "60", "--resolution", "64"]


def test_pack_and_check_agree(cans, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["pack", str(cans), "--container", BOX, "--out", str(out), "--record", *SMALL]) == 0
    line = capsys.readouterr().out
    assert line.count("\n") == 1
    assert (out / "run.html").read_text().startswith("<!DOCTYPE html>")
    assert "certified" in line
    record = json.loads((out / "result.json").read_text())
    assert record["density"] == pytest.approx(record["density_voxels"], rel=0.03)
    assert record["seed"] == 0
    assert main(["check", str(out)]) == 0
    assert main(["check", str(out / "scene.glb")]) == 0
    assert f"density {record['density']:.4f}, certified" in capsys.readouterr().out


def test_a_search_without_eq_1_is_not_recorded(cans, tmp_path, capsys):
    arguments = ["pack", str(cans), "--container", BOX, "--out", str(tmp_path / "out"), "--method", "dense", "--record"]
    assert main(arguments) == 2
    told = "rasp: method dense does not use record (--record); leave it out, or use --method paper\n"
    assert capsys.readouterr().err.endswith(told)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("more", [["--boxes", "auto"], ["--fixed", "cans"]])
def test_what_is_of_several_boxes_or_stays_is_not_recorded(cans, tmp_path, capsys, more):
    assert main(["pack", str(cans), "--container", BOX, "--out", str(tmp_path / "out"), "--record", *more]) == 2
    told = "rasp: --record shows the objects of one box on their way; leave out --boxes and --fixed\n"
    assert capsys.readouterr().err == told


def test_the_smallest_box_is_found_judged_and_told_in_the_unit(cans, tmp_path, capsys):
    out = tmp_path / "out"
    command = ["pack", str(cans), "--container", "auto:0.15,0.15,*", "--unit", "cm", "--effort", "3", "--out", str(out)]
    assert main(command) == 0
    printed = capsys.readouterr().out
    record = json.loads((out / "result.json").read_text())
    assert record["method"] == "dense"
    assert record["container"]["box"][:2] == pytest.approx([0.0015, 0.0015])
    height = 100 * record["container"]["box"][2]
    assert f": 4 of 4 objects in a box of 0.15 x 0.15 x {height:.4g} cm, density" in printed
    assert len(record["objects"]) == 4
    assert main(["check", str(out)]) == 0


def test_a_mesh_whose_name_begins_like_auto_is_a_mesh(cans, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mesh, out = tmp_path / "autobox.stl", tmp_path / "out"
    trimesh.creation.box([0.2] * 3).export(mesh)
    assert main(["pack", str(cans), "--container", "autobox.stl", "--method", "spectral", "--out", str(out)]) == 0
    assert "objects, density" in capsys.readouterr().out


def test_a_packing_falls_and_comes_apart(cans, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["pack", str(cans), "--container", BOX, "--settle", "--out", str(out), *SMALL]) == 0
    printed = capsys.readouterr().err
    assert "rasp: settled" in printed
    assert "straight pulls" in printed
    record = json.loads((out / "result.json").read_text())
    assert record["settled"]["moved_max"] > 0.01, "three cans in 20 cm fall"
    assert len(record["removal"]["order"]) == len(record["objects"])
    assert main(["check", str(out / "settled.glb")]) == 0


def test_a_packing_that_does_not_hold_ends_with_status_1_and_says_what_fails(cans, tmp_path, capsys):
    crowd = ["--repeat", "16", "--count", "16", "--iterations", "3", "--resolution", "64"]
    assert main(["pack", str(cans), "--container", "box:0.08,0.08,0.08", "--out", str(tmp_path / "out"), *crowd]) == 1
    printed = capsys.readouterr()
    assert "NOT certified" in printed.out
    assert "overlap by" in printed.err
    assert main(["check", str(tmp_path / "out")]) == 1


def test_objects_are_scaled_to_a_container_of_its_own_units(cans, tmp_path):
    trimesh.creation.icosphere(radius=50).export(tmp_path / "ball.ply")
    out = tmp_path / "out"
    arguments = ["--container", str(tmp_path / "ball.ply"), "--repeat", "12", "--fit-objects", "20", "--out", str(out)]
    assert main(["pack", str(cans), *arguments, *SMALL]) == 0
    assert json.loads((out / "result.json").read_text())["object_scale"] > 100


def test_check_names_what_is_not_there(tmp_path, capsys):
    assert main(["check", str(tmp_path / "gone")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_figures_names_what_is_not_there(capsys):
    assert main(["figures", "99_gone"]) == 2
    assert "no figure named 99_gone" in capsys.readouterr().err


def test_a_sweep_says_which_seed_packs_best_and_goes_on_where_it_ended(cans, tmp_path, capsys):
    out = tmp_path / "out"
    arguments = ["sweep", str(cans), "--container", BOX, "--seeds", "2", "--out", str(out), *SMALL]
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
def test_a_sweep_refuses_what_it_cannot_do(cans, tmp_path, capsys, option, value):
    arguments = ["sweep", str(cans), "--container", BOX, "--out", str(tmp_path / "out"), *SMALL, option, value]
    assert main(arguments) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.real_data
@pytest.mark.parametrize(("group", "options"), [("kitchen", []), ("blockout", ["--repeat", "100"])])
def test_real_pools_are_packed_and_judged_by_booleans_of_the_scene_alone(data, tmp_path, group, options):
    """A short search in a part of IR-BPP's container; every node a rigid copy of its file, nothing overlapping."""
    out = tmp_path / "out"
    small = ["--container", "box:0.16,0.16,0.16", "--iterations", "60", "--resolution", "64"]
    arguments = ["pack", str(data / group), *small, "--out", str(out)]
    assert main([*arguments, *options]) == 0
    scene = trimesh.load_scene(out / "scene.glb")
    for node in set(scene.graph.nodes_geometry) - {"container"}:
        transform, geometry = scene.graph[node]
        assert transform[:3, :3] @ transform[:3, :3].T == pytest.approx(np.eye(3), abs=1e-6)
        original = trimesh.load_mesh(data / group / f"{node.split('#')[0]}.obj", process=False)
        shape, wanted = (np.asarray(mesh.vertices) for mesh in (scene.geometry[geometry], original))
        assert shape - shape[0] == pytest.approx(wanted - wanted[0], abs=1e-6)
    assert main(["check", str(out)]) == 0


def test_a_packing_says_how_hard_each_term_pulled(cans, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["pack", str(cans), "--container", BOX, "--out", str(out), *SMALL]) == 0
    said = capsys.readouterr().err
    shares = json.loads((out / "result.json").read_text())["gradient_shares"]
    assert sum(shares.values()) == pytest.approx(1)
    assert shares["silhouette"] > 0
    assert f"shares of the gradient, in the mean over the run: silhouette {shares['silhouette']:.0%}" in said


def test_weightings_and_the_viewing_volume_are_options(cans, tmp_path, capsys):
    out = tmp_path / "out"
    arguments = ["--weighting", "no_shadows", "--viewing-volume", "1.5", "--epsilon", "0.001"]
    assert main(["pack", str(cans), "--container", BOX, "--out", str(out), *SMALL, *arguments]) == 0
    record = json.loads((out / "result.json").read_text())
    assert record["settings"]["viewing_volume"] == 1.5
    assert record["gradient_shares"]["silhouette"] == 0
    capsys.readouterr()
    once = ["--seeds", "1", "--workers", "1", "--count", "2", "--out", str(tmp_path / "s")]
    many = ["sweep", str(cans), "--container", BOX, *SMALL, *once, "--weighting", "summed", "no_shadows"]
    assert main(many) in (0, 1)
    assert "--weighting " in capsys.readouterr().out
    header = (tmp_path / "s" / "sweep.csv").read_text().splitlines()[0]
    assert header.startswith("lambda_,epsilon,weighting,seed,")


def test_a_clearance_is_kept_told_and_judged_again(cans, tmp_path, capsys):
    out, box = tmp_path / "out", "box:20,20,20"
    lengths = ["--unit", "cm", "--clearance", "0.5", "--wall-clearance", "0.8"]
    for can in cans.iterdir():
        trimesh.load(can).apply_scale(100).export(can)
    assert main(["pack", str(cans), "--container", box, "--method", "spectral", *lengths, "--out", str(out)]) == 0
    record = json.loads((out / "result.json").read_text())
    gaps = record["certificate"]["gaps"]
    assert gaps["holds"]
    assert (gaps["clearance"], gaps["wall_clearance"]) == pytest.approx((0.005, 0.008))
    assert gaps["least"]["gap"] >= 0.005 - 1e-12
    assert gaps["least_to_wall"]["gap"] >= 0.008 - 1e-12
    line = f"least gap {gaps['least']['gap'] * 100:.4g} cm ({gaps['least']['first']}, {gaps['least']['second']})"
    assert line in capsys.readouterr().err
    for asked in (lengths, ["--unit", "cm"]):  # what result.json says was asked counts if nothing is given
        assert main(["check", str(out), *asked]) == 0
        assert line.split(" (")[0] in capsys.readouterr().err
    assert main(["check", str(out), "--wall-clearance", "0.3"]) == 1
    assert "0.3 m are asked" in capsys.readouterr().err
    assert main(["check", str(out), "--clearance", "0.15"]) == 1
    printed = capsys.readouterr()
    assert "0.15 m are asked" in printed.err
    assert "NOT certified" in printed.out


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--clearance", "-4", "--unit", "mm"], "--clearance must be a length of 0 or more, got -4"),
        (["--wall-clearance", "nan"], "--wall-clearance must be a length of 0 or more, got nan"),
        (["--shadow", "hologram"], "shadow 'hologram' is unknown"),
    ],
)
def test_what_clearances_and_slices_cannot_be_is_told(cans, tmp_path, capsys, arguments, told):
    assert main(["pack", str(cans), "--container", BOX, "--out", str(tmp_path / "out"), *arguments]) == 2
    assert told in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_run_is_not_judged_by_a_clearance_that_is_none(cans, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["pack", str(cans), "--container", BOX, "--method", "dblf", "--out", str(out)]) == 0
    for wrong in ("nan", "-1"):
        assert main(["check", str(out), "--clearance", wrong]) == 2
        assert "must be a length of 0 or more" in capsys.readouterr().err
    for wrong in ("{", "[]"):
        (out / "result.json").write_text(wrong)
        assert main(["check", str(out)]) == 2
        assert "result.json: cannot be read" in capsys.readouterr().err


def test_one_goes_on_with_a_run_beside_a_zone(cans, tmp_path, capsys):
    first, again, post = tmp_path / "first", tmp_path / "again", tmp_path / "post.stl"
    trimesh.creation.box((20, 20, 300)).export(post)
    room = ["--container", "box:200,200,200", "--unit", "mm", "--method", "spectral"]
    for can in cans.iterdir():
        trimesh.load(can).apply_scale(1000).export(can)
    clear = ["--keep-out", str(post), "--clearance", "2"]
    assert main(["pack", str(cans / "can0.stl"), *room, *clear, "--out", str(first)]) == 0
    capsys.readouterr()
    assert main(["pack", str(cans), *room, *clear, "--fixed", str(first), "--out", str(again)]) == 0
    count = len(list(cans.iterdir()))
    assert f"{again}: {count} of {count} objects around 1, density" in capsys.readouterr().out
    record = json.loads((again / "result.json").read_text())
    assert [entry["name"] for entry in record["objects"] if entry.get("fixed")] == ["can0"]
    assert main(["check", str(again), "--unit", "mm"]) == 0, "the scene alone says the same"
    found = judge.read(again / "scene.glb")
    assert judge.least_gap(found) >= 0.002 * (1 - 1e-4)
    zone = manifold3d.Manifold.cube((0.02, 0.02, 0.3), True)
    assert min(solid.min_gap(zone, 1) for solid, _ in found.values()) >= 0.002 * (1 - 1e-4)
    for wrong, told in ((["--settle"], "--settle lets all objects fall"), (["--boxes", "2"], "fixed is of one box")):
        assert main(["pack", str(cans), *room, "--fixed", str(first), *wrong, "--out", str(tmp_path / "no")]) == 2
        assert told in capsys.readouterr().err
        assert not (tmp_path / "no").exists()


def test_several_boxes_are_packed_and_told(cans, tmp_path, capsys):
    out, room = tmp_path / "out", ["--container", "box:0.13,0.13,0.13", "--method", "spectral"]
    assert main(["pack", str(cans), *room, "--boxes", "auto", "--out", str(out)]) == 0
    printed = capsys.readouterr()
    boxes = json.loads((out / "boxes.json").read_text())["boxes"]
    count = len(list(cans.iterdir()))
    assert f"{out}: {count} of {count} objects in {len(boxes)} box" in printed.out
    assert "rasp: box 1: " in printed.err
    assert sum(box["objects"] for box in boxes) == count
    assert main(["check", str(out)]) == 0
    assert capsys.readouterr().out.count("certified") == len(boxes)
    table = tmp_path / "parts.csv"
    table.write_text("file,count,must\ncans/can0.stl,30,yes\n")
    assert main(["pack", "--parts", str(table), *room, "--boxes", "1", "--out", str(out)]) == 1
    assert "rasp: must go in, but found no place: can0#" in capsys.readouterr().err
    for wrong in (["--boxes", "0"], ["--boxes", "few"], ["--boxes", "2", "--settle"], ["--boxes", "2", "--count", "3"]):
        assert main(["pack", str(cans), "--container", BOX, *wrong, "--out", str(tmp_path / "no")]) == 2
        assert capsys.readouterr().err.count("\n") == 1


def test_slices_can_take_the_place_of_silhouettes(cans, tmp_path):
    arguments = ["--method", "paper", "--shadow", "slices", *SMALL, "--out", str(tmp_path / "out")]
    assert main(["pack", str(cans), "--container", BOX, *arguments]) == 0
    assert json.loads((tmp_path / "out" / "result.json").read_text())["settings"]["shadow"] == "slices"


def test_a_table_says_what_goes_in(cans, tmp_path, capsys):
    table = tmp_path / "parts.csv"
    table.write_text("file,count,must,turns\ncans/can0.stl,3,,z\ncans/can3.stl,2,yes,none\n")
    out = tmp_path / "out"
    command = ["pack", "--parts", str(table), f"{cans / 'can1.stl'}*2", "--container", "box:0.2,0.2,0.06"]
    assert main([*command, "--method", "spectral", "--out", str(out)]) == 0
    record = json.loads((out / "result.json").read_text())
    names = [entry["name"].split("#")[0] for entry in record["objects"]]
    assert (names.count("can0"), names.count("can1"), names.count("can3")) == (3, 2, 2)
    assert record["missing"] == []
    assert {entry.get("turns") for entry in record["objects"]} == {"z", "none", None}
    capsys.readouterr()
    table.write_text("file,count,must\ncans/can3.stl,9,yes\n")
    command = ["pack", "--parts", str(table), "--container", "box:0.15,0.15,0.06", "--method", "spectral"]
    assert main([*command, "--out", str(out)]) == 1
    assert "rasp: must go in, but found no place: can3#" in capsys.readouterr().err
    table.write_text("file,count\ncans/can3.stl,few\n")
    assert main([*command, "--out", str(out)]) == 2
    assert "row 2, column count: a whole number" in capsys.readouterr().err


def test_parts_are_exported_in_their_places(cans, tmp_path):
    out = tmp_path / "out"
    command = ["pack", str(cans / "can0.stl") + "*2", "--container", BOX, "--method", "spectral", "--out", str(out)]
    assert main([*command, "--export", "3mf,stl,csv"]) == 0
    shown = np.concatenate([np.reshape(s.bounding_box(), (2, 3)) for s, _ in judge.read(out / "scene.glb").values()])
    for name in ("parts.3mf", "parts.stl"):
        corners = np.concatenate([mesh.vertices for mesh in trimesh.load_scene(out / name).dump()]) / 1000
        assert corners.min(0) == pytest.approx(shown.min(0), abs=1e-6)
        assert corners.max(0) == pytest.approx(shown.max(0), abs=1e-6)
    assert len((out / "parts.csv").read_text().splitlines()) == 3
    assert main([*command, "--export", "step"]) == 2


def test_a_packing_comes_apart_in_the_order_that_is_told_and_judged_again(cans, tmp_path, capsys):
    out = tmp_path / "out"
    command = ["pack", str(cans), "--container", "box:0.11,0.11,0.13", "--method", "spectral", "--separable"]
    assert main([*command, "--out", str(out)]) == 0
    record = json.loads((out / "result.json").read_text())
    loading = record["separable"]["loading"]
    assert {step["name"] for step in loading} == {part["name"] for part in record["objects"]}
    assert judge.most_shared_on_the_way(judge.read(out / "scene.glb"), loading, samples=50) <= 1e-4
    assert main(["check", str(out)]) == 0
    assert capsys.readouterr().err.count("rasp: comes apart through the top, one by one") == 2
    record["separable"]["loading"].reverse()
    (out / "result.json").write_text(json.dumps(record))
    assert main(["check", str(out)]) == 1
    (out / "result.json").unlink()
    for asked in ([], ["--separable"]):
        assert main(["check", str(out), *asked]) == 0
        assert ("comes apart" in capsys.readouterr().err) == bool(asked)
