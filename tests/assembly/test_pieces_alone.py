"""Assembly from the pieces alone, against where they were cut out."""

import json

import numpy as np
import pytest
import trimesh

from data_fetch import fracture, scatter, vessels
from rasp_core.assembly.metrics import measure
from rasp_core.assembly.pieces_alone import assemble_alone
from rasp_core.cli.main import main
from rasp_core.geometry.meshes import make_body
from rasp_core.util.errors import InputError


def ball(name):
    mesh = trimesh.creation.icosphere(3, 0.05)
    return make_body(name, mesh.vertices, mesh.faces)


@pytest.mark.parametrize(("which", "count"), [(1, 2), (2, 3)])
def test_scattered_pieces_come_back_without_the_whole(which, count):
    moved, truth = scatter(fracture(vessels()[which], count, seed=1))
    found = assemble_alone(moved)
    errors = measure(moved, found.matrices, truth)
    assert errors.parts == 1
    assert errors.rotation.max() < 3
    assert list(found.warnings) == []
    assert found.certificate.overlap_volume < 0.01 * sum(body.volume for body in moved)
    assert not found.certificate.protrusions


def test_the_largest_piece_keeps_its_orientation_and_the_box_is_about_all():
    moved, _ = scatter(fracture(vessels()[1], 2, seed=1))
    found = assemble_alone(moved)
    assert found.poses.rotation[0].numpy() == pytest.approx(np.eye(3))
    corners = np.concatenate([b.placed(m) for b, m in zip(moved, found.matrices, strict=True)])
    assert corners.max(0) == pytest.approx(-corners.min(0))
    assert found.container.size == pytest.approx(1.02 * np.ptp(corners, axis=0))


def test_a_piece_of_something_else_is_named_and_lies_apart():
    moved, truth = scatter(fracture(vessels()[1], 2, seed=1))
    found = assemble_alone([moved[0], ball("pebble"), moved[1]])
    assert list(found.warnings) == ["pebble belongs to none of the others; it lies beside them"]
    assert found.scores[1] == 0
    assert measure(moved, found.matrices[[0, 2]], truth).parts == 1
    assert not any("pebble" in (o.first, o.second) for o in found.certificate.overlaps)


def test_pieces_that_have_nothing_in_common():
    with pytest.raises(InputError, match="no two of the 2 pieces fit each other"):
        assemble_alone([ball("one"), ball("two")])


def test_one_piece_is_refused():
    with pytest.raises(InputError, match="at least two parts, got 1"):
        assemble_alone([ball("one")])


def test_the_command_needs_no_whole(tmp_path, capsys):
    (tmp_path / "parts").mkdir()
    moved, truth = scatter(fracture(vessels()[1], 2, seed=1))
    for body in moved:
        trimesh.Trimesh(body.vertices, body.faces, process=False).export(tmp_path / "parts" / f"{body.name}.ply")
    assert main(["assemble", str(tmp_path / "parts"), "--out", str(tmp_path / "run")]) == 0
    record = json.loads((tmp_path / "run" / "result.json").read_text())
    assert measure(moved, np.array([entry["pose"] for entry in record["objects"]]), truth).parts == 1
    assert record["holes"] == []
    assert "2 parts, creases matched: " in capsys.readouterr().out
