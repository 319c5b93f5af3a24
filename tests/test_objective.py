"""Eq. 1 is the weighted sum of its terms, each as its own function has it."""

import pytest
import torch

from rasp_core import losses, poses
from rasp_core.objective import LOSS_NAMES, objective
from rasp_core.problem import Settings
from rasp_core.query_points import query_lattice
from rasp_core.silhouettes import render

SETTINGS = Settings(resolution=64, query_points=4000, softness_px=0.0, overlap_weight=2.0, lambda_=0.5)


@pytest.fixture
def given(crowd):
    """A scene, poses in it, targets and query points."""
    scene, turns, translation = crowd
    rotation = poses.angles_to_rotation(turns)
    lattice = query_lattice(scene.container, SETTINGS.query_points, dtype=torch.float64)
    return scene, rotation, translation, scene.container_silhouettes(64), lattice


def test_eq_1_is_the_weighted_sum_of_its_terms(given):
    scene, rotation, translation, targets, lattice = given
    values, images = objective(*given, SETTINGS)
    found = dict(zip(LOSS_NAMES, values.tolist(), strict=True))
    drawn = render(scene.outlines, rotation, translation, scene.views, 64)
    assert torch.equal(images, drawn)
    assert found["silhouette"] == pytest.approx((drawn - targets).square().mean().item())
    overlap = losses.overlap(scene.stack, scene.half, rotation, translation, lattice)
    assert found["overlap"] == pytest.approx(overlap.item())
    outside = losses.extrusion(
        scene.container,
        scene.outlines.vertices,
        scene.outlines.vertex_body,
        scene.radius,
        rotation,
        translation,
        SETTINGS.epsilon,
    )
    assert found["extrusion"] == pytest.approx(outside.item())
    assert found["contact"] == 0
    total = found["silhouette"] + 2 * found["overlap"] + 0.5 * found["extrusion"]
    assert found["total"] == pytest.approx(total)


def test_a_term_of_weight_0_is_not_computed(given):
    silent = Settings(resolution=64, silhouette_weight=0, overlap_weight=0, lambda_=0)
    values, images = objective(*given, silent)
    assert images is None
    assert values.tolist() == [0.0] * len(LOSS_NAMES)
