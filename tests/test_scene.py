"""A problem's tensors."""

import pytest
import torch

from data_fetch import kitchen_like
from rasp_core.geometry import containers
from rasp_core.scene import Scene
from rasp_core.util.errors import InputError

BOX = containers.box((0.3, 0.3, 0.3))


def test_squeezed_silhouettes_are_those_of_a_lower_box_on_the_same_floor():
    scene = Scene(kitchen_like(1), BOX, BOX.views())
    squeezed, full = scene.container_silhouettes(128, 0.5), scene.container_silhouettes(128)
    side = [k for k, camera in enumerate(scene.cameras) if camera.elevation_deg == 0]
    assert len(side) == 2
    for k in side:
        rows = full[k].sum(1).nonzero()[:, 0]
        middle = (rows[0] + rows[-1] + 1) // 2
        assert torch.equal(squeezed[k, middle:], full[k, middle:])
        assert not squeezed[k, : middle - 1].any()


def test_a_boxes_silhouettes_are_its_faces():
    scene = Scene(kitchen_like(1), containers.box((0.4, 0.2, 0.1)), containers.box((0.4, 0.2, 0.1)).views())
    targets = scene.container_silhouettes(128)
    pixel = (scene.width / 128) ** 2
    assert (targets.sum((1, 2)) * pixel).numpy() == pytest.approx([0.04, 0.02, 0.08], rel=0.02)


def test_nothing_to_arrange_is_refused():
    with pytest.raises(InputError, match="nothing to arrange"):
        Scene([], BOX, BOX.views())
    with pytest.raises(InputError, match="may move"):
        Scene(kitchen_like(2), BOX, BOX.views(), obstacles=2)
