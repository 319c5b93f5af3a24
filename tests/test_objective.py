"""Eq. 1 is the weighted sum of its terms, each as its own function has it."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from data_fetch import kitchen_like
from rasp_core import losses, poses
from rasp_core.geometry.containers import box
from rasp_core.objective import LOSS_NAMES, objective, pull_shares, pulls, term_weights
from rasp_core.poses import Poses
from rasp_core.problem import SHADOWS, WEIGHTINGS, Problem, Settings
from rasp_core.query_points import query_lattice
from rasp_core.silhouettes import render

SETTINGS = Settings(
    weighting="printed", resolution=64, query_points=4000, softness_px=0.0, overlap_weight=2.0, lambda_=0.5
)


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


def test_weightings_sum_or_average_as_they_say(given):
    scene, *_, lattice = given
    settings = Settings(resolution=64, query_points=4000, lambda_=0.5, epsilon=0.02, contact_weight=1.0)
    pixels, points, corners = 3 * 64 * 64, np.prod(lattice.shape), len(scene.outlines.vertices)
    expected = {
        "printed": (1, 1, 0.5, 1),
        "overlap_mean": (1, 1 / points, 0.5, 1),
        "means": (1, 1 / points, 0.5 / corners, 1),
        "pixel_sum": (pixels, 1, 0.5, 1),
        "summed": np.array((pixels * lattice.spacing, 1, 0.5, 1)) / lattice.spacing,
        "authors": np.array((0.5 * pixels * lattice.spacing, 0.1, 0, 1)) / lattice.spacing,
        "walls": (1, 1, 1500, 1),
        "no_shadows": (0, 1, 500, 1),
    }
    assert expected.keys() == WEIGHTINGS.keys()
    for name, weights in expected.items():
        assert term_weights(scene, lattice, replace(settings, weighting=name)) == pytest.approx(weights), name


def test_the_balance_of_summed_terms_does_not_depend_on_the_unit():
    """The same objects in metres and in millimetres: each term's share of the gradient is the same."""
    found = []
    for unit in (1.0, 1000.0):
        bodies, room = [body.scaled(unit) for body in kitchen_like(6)], box((0.15 * unit,) * 3)
        settings = Settings(resolution=64, query_points=4000, epsilon=0.01 * unit, lambda_=1.0)
        scene = Problem(bodies, room).scene(dtype=torch.float64, viewing_volume=2.0)
        start = Poses.random(bodies, room, 0)
        translation = start.translation.double().requires_grad_()
        lattice = query_lattice(room, settings.query_points, dtype=torch.float64)
        targets = scene.container_silhouettes(64)
        values, _ = objective(scene, start.rotation.double(), translation, targets, lattice, settings)
        pulled = pulls(values, term_weights(scene, lattice, settings), translation)
        found.append(pull_shares(pulled.numpy()[None]))
    assert found[0][:3] == pytest.approx(found[1][:3], rel=1e-3)
    assert (found[0][:3] > 0).all()


def test_pulls_are_the_terms_own_gradients(given):
    scene, rotation, translation, targets, lattice = given
    place = translation.detach().clone().requires_grad_()
    values, _ = objective(scene, rotation.detach(), place, targets, lattice, SETTINGS)
    found = pulls(values, term_weights(scene, lattice, SETTINGS), place)
    alone = {"silhouette": {"overlap_weight": 0, "lambda_": 0}, "overlap": {"silhouette_weight": 0, "lambda_": 0}}
    for column, off in enumerate(alone.values()):
        again = translation.detach().clone().requires_grad_()
        total = objective(scene, rotation.detach(), again, targets, lattice, replace(SETTINGS, **off))[0][0]
        total.backward()
        assert found[column].item() == pytest.approx(again.grad.norm(dim=1).mean().item(), rel=1e-6)
    assert found[3] == 0
    values[0].backward()  # still possible
    assert place.grad.abs().sum() > 0


def test_shares_are_means_over_the_rows_in_which_something_pulls():
    assert pull_shares(np.array([[1.0, 3, 0, 0], [0, 0, 0, 0], [1, 1, 0, 0]])).tolist() == [0.375, 0.625, 0, 0]
    assert pull_shares(np.zeros((2, 4))).tolist() == [0, 0, 0, 0]


def test_slices_pull_apart_what_casts_one_shadow():
    """Two cans, one behind the other along y and overlapping: silhouettes from the front do not see it, slices do."""
    bodies = [kitchen_like(1)[0]] * 2
    room = box((0.3, 0.3, 0.3))
    scene = Problem(bodies, room, cameras=room.views()[:1]).scene(dtype=torch.float64)
    lattice = query_lattice(room, 4000, dtype=torch.float64)
    found = {}
    for shadow in SHADOWS:
        settings = Settings(resolution=64, overlap_weight=0, lambda_=0, shadow=shadow)
        place = torch.tensor([[0.0, -0.01, 0], [0, 0.01, 0]], dtype=torch.float64, requires_grad=True)
        targets = Problem(bodies, room).target_images(scene, 64, shadow)
        turns = torch.eye(3, dtype=torch.float64).expand(2, 3, 3)
        values, images = objective(scene, turns, place, targets, lattice, settings)
        assert images.shape == targets.shape
        values[0].backward()
        found[shadow] = place.grad[1, 1].item()
    assert found["silhouette"] == 0
    assert found["thickness"] == 0
    assert found["slices"] < 0, "downhill is further back"
