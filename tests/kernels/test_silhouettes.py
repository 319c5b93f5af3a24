"""The compiled renderer against the plain torch one."""

import pytest
import torch

from data_fetch import cad_like, kitchen_like
from rasp_core import poses, silhouettes
from rasp_core.geometry.cameras import Camera
from rasp_core.kernels import dispatch


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize(("dtype", "tolerance"), [(torch.float64, 1e-9), (torch.float32, 1e-3)])
@pytest.mark.parametrize("resolution", [64, 200])
def test_images_masks_and_gradients(projection, dtype, tolerance, resolution):
    """Bodies across the borders included; one view of the other kind among them."""
    bodies = kitchen_like(12) + cad_like(10)
    generator = torch.Generator().manual_seed(0)
    cameras = [
        Camera(10, 20, 0.3, (0.02, 0, 0), projection),
        Camera(75, -40, 0.4, (0, 0, 0), projection),
        Camera(0, 90, 0.3),
    ]
    outlines, views = silhouettes.Outlines(bodies, dtype=dtype), silhouettes.Views(cameras, dtype=dtype)
    turns = (6 * torch.rand(22, 3, generator=generator)).to(dtype)
    place = (0.3 * torch.rand(22, 3, generator=generator) - 0.15).to(dtype)
    weight = torch.randn(3, resolution, resolution, generator=generator).to(dtype)
    found = {}
    for name in dispatch.ENGINES:
        with dispatch.use(name):
            angles, centre = turns.clone().requires_grad_(), place.clone().requires_grad_()
            rotation = poses.angles_to_rotation(angles)
            image = silhouettes.render(outlines, rotation, centre, views, resolution)
            (image * weight).sum().backward()
            mask = silhouettes.mask(outlines, rotation, centre, views, resolution)
            found[name] = image.detach(), mask, angles.grad, centre.grad
    compiled, plain = found["auto"], found["torch"]
    assert (compiled[0] - plain[0]).abs().max() <= tolerance
    assert (compiled[1] != plain[1]).sum() <= (0 if dtype == torch.float64 else 3)
    for a, b in zip(compiled[2:], plain[2:], strict=True):
        assert (a - b).abs().max() <= tolerance * b.abs().max()


@pytest.mark.parametrize("name", dispatch.ENGINES)
def test_several_starts_are_drawn_as_each_alone(crowd, name):
    scene, turns, place = crowd
    rotation, centre = poses.angles_to_rotation(torch.stack([turns, turns + 1])), torch.stack([place, -place])
    with dispatch.use(name):
        images = silhouettes.render(scene.outlines, rotation, centre, scene.views, 96)
        alone = [silhouettes.render(scene.outlines, rotation[k], centre[k], scene.views, 96) for k in range(2)]
    assert torch.equal(images, torch.stack(alone))
    assert not torch.equal(*alone)
