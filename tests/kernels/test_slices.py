"""Slices against what can be computed by hand, and the compiled loops of `splat` against plain torch."""

import numpy as np
import pytest
import torch
import trimesh

from data_fetch import kitchen_like
from rasp_core import poses
from rasp_core.geometry import containers
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.interior_points import interior_points
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.silhouette_edges import Views
from rasp_core.kernels import dispatch, slices
from rasp_core.util.errors import InputError

BOX = containers.box((0.3, 0.25, 0.2))
BODIES = kitchen_like(5)


def crowd(dtype=torch.float64):
    generator = torch.Generator().manual_seed(0)
    turns = poses.quaternion_to_rotation(poses.random_quaternions(5, generator, torch.float64))
    return interior_points(BODIES, 0.006, dtype=dtype), turns.to(dtype), BOX.random_points(5, generator).to(dtype)


def test_a_plate_fills_the_layers_that_it_lies_in():
    """A plate of 8 x 8 x 2 cm, seen from the front, from the side and from above in a volume of 16 cm."""
    plate = trimesh.creation.box((0.08, 0.08, 0.02))
    material = interior_points([make_body("plate", plate.vertices, plate.faces)], 0.001)
    views = Views(containers.box((0.16, 0.16, 0.16)).views(1.0))
    images = slices.render(material, torch.eye(3)[None], torch.tensor([[0.0, 0.0, 0.03]]), views, 16, 8)
    front, _, above = images.view(3, 8, 16, 16)
    upright = front[:, 3:7, 8].sum(1)  # 1 to 5 cm above the centre, so that what the edges share out is there
    assert upright[3:5].tolist() == pytest.approx([2, 2], abs=0.02), "pixels of 1 cm, full in the middle layers"
    assert upright[[0, 7]].max() == 0
    assert front[:, 8:].max() < 0.02, "nothing below the centre, but half a pixel's reach"
    # the plate lies between 2 and 4 cm above the centre: the third layer from above, shared out over its neighbours
    in_layers = above[:, 8, 8]
    assert in_layers.sum().item() == pytest.approx(1, abs=0.01)
    assert in_layers.argmax() == 2
    assert above[5:].max() == 0


@pytest.mark.parametrize("layers", [1, 6])
def test_no_material_is_lost(layers):
    material, turns, place = crowd()
    views = Views(BOX.views(2.0), dtype=torch.float64)
    images = slices.render(material, turns, place, views, 40, layers).view(3, -1)
    cell = (views.width / 40) ** 2 * views.width / layers
    volume = sum(body.volume for body in BODIES)
    assert (images.sum(1) * cell).numpy() == pytest.approx(np.full(3, volume), rel=1e-9)


def test_what_two_bodies_share_counts_twice():
    material = interior_points([BODIES[0], BODIES[0]], 0.004)
    views = Views(BOX.views(2.0))
    both = slices.render(material, torch.eye(3).expand(2, 3, 3), torch.zeros(2, 3), views, 32, 1)
    alone = slices.render(interior_points([BODIES[0]], 0.004), torch.eye(3)[None], torch.zeros(1, 3), views, 32, 1)
    assert torch.allclose(both, 2 * alone)


@pytest.mark.parametrize("layers", [1, 5])
def test_gradients_are_differences(layers):
    """The derivative of a smooth function of the slices, by double precision differences."""
    material, turns, place = crowd()
    views = Views(BOX.views(2.0), dtype=torch.float64)
    weight = torch.rand(3 * layers, 24, 24, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    angles = poses.rotation_to_angles(turns)

    def value(angles, place):
        images = slices.render(material, poses.angles_to_rotation(angles), place, views, 24, layers)
        return (images * weight).sum()

    angles, place = angles.clone().requires_grad_(), place.clone().requires_grad_()
    value(angles, place).backward()
    for variable in (angles, place):
        for index in ((0, 0), (2, 1), (4, 2)):
            step = torch.zeros_like(variable)
            step[index] = 1e-9  # so small that hardly a point passes a pixel's centre
            with torch.no_grad():
                moved = [
                    [angles + s * step, place] if variable is angles else [angles, place + s * step] for s in (1, -1)
                ]
                slope = (value(*moved[0]) - value(*moved[1])) / 2e-9
            assert variable.grad[index].item() == pytest.approx(slope.item(), rel=2e-3, abs=1e-3)


@pytest.mark.parametrize("layers", [1, 5])
@pytest.mark.parametrize(("dtype", "tolerance"), [(torch.float64, 1e-10), (torch.float32, 1e-4)])
def test_compiled_loops_give_what_plain_torch_gives(layers, dtype, tolerance):
    """Bodies that stick out of the picture included."""
    material, turns, place = crowd(dtype)
    views = Views(BOX.views(0.8), dtype=dtype)
    found = {}
    for engine in dispatch.ENGINES:
        with dispatch.use(engine):
            angles, centre = poses.rotation_to_angles(turns).requires_grad_(), place.clone().requires_grad_()
            images = slices.render(material, poses.angles_to_rotation(angles), centre, views, 20, layers)
            images.square().sum().backward()
            found[engine] = images.detach(), angles.grad, centre.grad
    for compiled, plain in zip(found["auto"], found["torch"], strict=True):
        assert (compiled - plain).norm() <= tolerance * plain.norm()
        assert plain.norm() > 0


def test_several_starts_give_what_each_gives():
    material, turns, place = crowd()
    views = Views(BOX.views(2.0), dtype=torch.float64)
    rotation, translation = torch.stack([turns, turns.transpose(1, 2)]), torch.stack([place, -place])
    together = slices.render(material, rotation, translation, views, 16, 4)
    assert together.shape == (2, 12, 16, 16)
    for one in range(2):
        alone = slices.render(material, rotation[one], translation[one], views, 16, 4)
        assert torch.equal(together[one], alone)


def test_perspective_views_are_refused():
    material, turns, place = crowd()
    views = Views([Camera(0, 0, 1.0, projection="perspective")], dtype=torch.float64)
    with pytest.raises(InputError, match="slices need orthographic views"):
        slices.render(material, turns, place, views, 16, 4)
