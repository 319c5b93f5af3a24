"""Errors of assemblies whose errors are known."""

import numpy as np
import pytest
import trimesh

from rasp_core.assembly import metrics
from rasp_core.geometry.meshes import make_body
from rasp_core.util.errors import InputError


@pytest.fixture
def parts():
    """A large brick and a small one beside it, 0.5 m in all along x."""
    large, small = trimesh.creation.box((0.4, 0.2, 0.2)), trimesh.creation.box((0.1, 0.2, 0.2))
    small.apply_translation((0.25, 0, 0))
    return [make_body(name, m.vertices, m.faces) for name, m in (("large", large), ("small", small))]


DIAGONAL = np.sqrt(0.5**2 + 0.2**2 + 0.2**2)


def motion(angle_deg=0.0, shift=(0, 0, 0), axis=(0, 0, 1), point=None):
    matrix = trimesh.transformations.rotation_matrix(np.radians(angle_deg), axis, point)
    matrix[:3, 3] += shift
    return matrix


def test_a_motion_of_all_is_no_error(parts):
    truth = np.stack([np.eye(4)] * 2)
    found = metrics.measure(parts, motion(50, (1, 2, 3), (1, 2, 0)) @ truth, truth)
    assert found.parts == 1
    assert found.rotation == pytest.approx(np.zeros(2), abs=1e-4)
    assert found.translation == pytest.approx(np.zeros(2), abs=1e-9)


def test_a_part_that_is_shifted_and_turned(parts):
    truth = np.stack([np.eye(4)] * 2)
    wrong = np.stack([np.eye(4), motion(30, (0, 0, 0.1), point=parts[1].centre)])
    found = metrics.measure(parts, wrong, truth)
    assert found.rotation == pytest.approx([0, 30], abs=1e-4)
    assert found.translation == pytest.approx([0, 0.1 / DIAGONAL], abs=1e-9)
    assert found.chamfer[1] > 0.01
    assert found.parts == 0.5


def test_a_symmetric_part_is_judged_by_its_shape(parts):
    truth = np.stack([np.eye(4)] * 2)
    turned = np.stack([np.eye(4), motion(180, axis=(1, 0, 0), point=parts[1].centre)])
    found = metrics.measure(parts, turned, truth)
    assert found.rotation[1] == pytest.approx(180)
    assert found.parts == 1


def test_the_largest_part_aligns(parts):
    truth = np.stack([np.eye(4)] * 2)
    found = metrics.measure(parts, np.stack([motion(shift=(0, 0.1, 0)), np.eye(4)]), truth)
    assert found.translation == pytest.approx([0, 0.1 / DIAGONAL])


def test_as_many_poses_as_parts(parts):
    with pytest.raises(InputError, match="2 parts need as many poses, got 1 and 2"):
        metrics.measure(parts, np.stack([np.eye(4)]), np.stack([np.eye(4)] * 2))


def test_breaking_bads_measures_of_a_known_motion(parts):
    truth = np.stack([np.eye(4)] * 2)
    wrong = np.stack([np.eye(4), motion(30, (0, 0, 0.1), point=parts[1].centre)])
    found = metrics.breaking_bad(parts, motion(70, (1, 2, 3), (1, 1, 0)) @ wrong, truth)
    assert found.rotation_rmse_deg == pytest.approx(30 / np.sqrt(3) / 2, abs=1e-4)  # of one angle of three, one of two
    assert found.translation_rmse == pytest.approx(0.1 / np.sqrt(3) / 0.5 / 2)


def test_an_angle_is_at_most_half_a_turn_away(parts):
    truth = np.stack([np.eye(4), motion(175)])
    found = metrics.breaking_bad(parts, np.stack([np.eye(4), motion(-175)]), truth)
    assert found.rotation_rmse_deg == pytest.approx(10 / np.sqrt(3) / 2, abs=1e-4)


def test_breaking_bads_chamfer_distance_against_all_pairs(parts, monkeypatch):
    monkeypatch.setattr(metrics, "SAMPLES", 200)
    truth = np.stack([np.eye(4)] * 2)
    found = metrics.breaking_bad(parts, np.stack([np.eye(4), motion(shift=(0.15, 0, 0))]), truth)
    clouds = [metrics.surface_points(b.placed(np.eye(4)), b.solid_faces, 200)[0] / 0.5 for b in parts]
    moved = [clouds[0], clouds[1] + [0.3, 0, 0]]

    def chamfer(a, b):
        square = ((a[:, None] - b[None]) ** 2).sum(2)
        return square.min(0).mean() + square.min(1).mean()

    assert found.chamfer == pytest.approx(chamfer(np.concatenate(clouds), np.concatenate(moved)))
    assert chamfer(clouds[1], moved[1]) > 0.01
    assert found.parts == 0.5


def test_breaking_bad_is_the_laxer_judge(parts):
    truth = np.stack([np.eye(4)] * 2)
    moved = np.stack([np.eye(4), motion(shift=(0.02, 0.01, 0))])
    assert metrics.measure(parts, moved, truth).parts == 0.5
    assert metrics.breaking_bad(parts, moved, truth).parts == 1


def test_breaking_bad_needs_as_many_poses_as_parts(parts):
    with pytest.raises(InputError, match="2 parts need as many poses, got 1 and 2"):
        metrics.breaking_bad(parts, np.stack([np.eye(4)]), np.stack([np.eye(4)] * 2))
