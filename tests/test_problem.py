"""Settings, their schedules, and poses to start from."""

import pytest
import torch

from data_fetch import kitchen_like
from rasp_core import poses
from rasp_core.geometry import containers
from rasp_core.poses import Poses
from rasp_core.problem import SHADOWS, Problem, Settings
from rasp_core.util.errors import InputError

BOX = containers.box((0.3, 0.3, 0.3))


def test_schedules_fall_geometrically():
    settings = Settings(iterations=100, learning_rate=1e-2, final_learning_rate=1e-4, softness_px=8, resolution=128)
    assert [settings.rate(i) for i in (0, 50, 100)] == pytest.approx([1e-2, 1e-3, 1e-4])
    assert settings.softness(0) == pytest.approx(4), "given for 256 pixels"
    assert Settings(softness_px=0).softness(50) == 0


@pytest.mark.parametrize(
    "bad",
    [
        {"iterations": 0},
        {"learning_rate": float("nan")},
        {"query_points": -1},
        {"lambda_": -1.0},
        {"softness_px": -1.0},
        {"rotation": "matrix"},
        {"overlap_term": "none"},
        {"weighting": "unheard-of"},
        {"viewing_volume": 0.9},
        {"query_volume": 0.9},
        {"shadow": "hologram"},
    ],
)
def test_impossible_settings_are_refused(bad):
    with pytest.raises(InputError, match=next(iter(bad))):
        Settings(**bad)


def test_random_starts_lie_inside_and_turn_anywhere():
    start = Poses.random(kitchen_like(50), BOX, 3)
    assert (start.translation.abs() < 0.15).all()
    assert poses.degrees_between(start.rotation[:-1], start.rotation[1:]).std() > 20
    assert torch.equal(start.take([4, 2]).translation, start.translation[[4, 2]])


def test_only_views_of_the_containers_own_are_widened():
    bodies = kitchen_like(2)
    wide = Problem(bodies, BOX).scene(viewing_volume=2.0)
    assert [camera.width for camera in wide.cameras] == pytest.approx([0.6] * 3)
    given = BOX.views()
    assert Problem(bodies, BOX, given).scene(viewing_volume=2.0).cameras == given
    targets = torch.zeros(3, 8, 8).numpy()
    assert Problem(bodies, BOX, targets=targets).scene(viewing_volume=2.0).cameras == given


def test_each_shadow_has_the_containers_own_as_its_target():
    problem = Problem(kitchen_like(2), BOX)
    scene = problem.scene(viewing_volume=2.0)
    assert problem.target_images(scene, 32).shape == (3, 32, 32)
    for shadow, layers in SHADOWS.items():
        if layers:
            images = problem.target_images(scene, 32, shadow).view(3, layers, 16, 16)
            cell = (0.6 / 16) ** 2 * 0.6 / layers
            assert (images.sum((1, 2, 3)) * cell).tolist() == pytest.approx([BOX.volume] * 3, rel=1e-5)


def test_slices_are_not_compared_with_given_silhouettes():
    problem = Problem(kitchen_like(2), BOX, targets=torch.zeros(3, 8, 8).numpy())
    with pytest.raises(InputError, match="targets are silhouettes, so the shadow 'slices' cannot be compared"):
        problem.target_images(problem.scene(), 8, "slices")
