"""The renderer against ray casting, analytic shapes and finite differences."""

import math

import numpy as np
import pytest
import torch
import trimesh
from oracles import cast_mask, central_differences, iou

from data_fetch import cad_like, kitchen_like
from rasp_core import losses, poses, silhouettes
from rasp_core.geometry.cameras import Camera, box_views
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.silhouette_edges import contour_edges, project

BOTH = ["orthographic", "perspective"]


def turned(count, generator, dtype=torch.float32):
    return poses.quaternion_to_rotation(poses.random_quaternions(count, generator, dtype))


def shot(bodies, rotation, translation, cameras, resolution):
    dtype = rotation.dtype
    outlines, views = silhouettes.Outlines(bodies, dtype=dtype), silhouettes.Views(cameras, dtype=dtype)
    return silhouettes.render(outlines, rotation, translation, views, resolution)


@pytest.mark.parametrize("projection", BOTH)
@pytest.mark.parametrize("resolution", [64, 256, 1024])
def test_procedural_bodies_match_ray_casting(projection, resolution):
    generator = torch.Generator().manual_seed(1)
    bodies = kitchen_like(6) + cad_like(4)
    rotation, translation = turned(10, generator), (torch.rand(10, 3, generator=generator) - 0.5) * 0.3
    cameras = [Camera(33, 12, 0.5, (0, 0, 0), projection), Camera(250, -60, 0.5, (0.02, 0, 0), projection)]
    outlines, views = silhouettes.Outlines(bodies), silhouettes.Views(cameras)
    masks = silhouettes.mask(outlines, rotation, translation, views, resolution)
    images = silhouettes.render(outlines, rotation, translation, views, resolution)
    for mask, image, camera in zip(masks, images, cameras, strict=True):
        truth = cast_mask(bodies, rotation, translation, camera, resolution)
        assert iou(mask.numpy(), truth) >= 0.998
        assert iou((image >= 0.5).numpy(), truth) >= (0.995 if resolution > 64 else 0.99)  # walls thinner than a pixel


@pytest.mark.real_data
@pytest.mark.parametrize("projection", BOTH)
def test_ten_real_meshes_match_ray_casting(kitchen, projection):
    """Random poses and directions at 256 x 256; thresholded at 0.5, the soft image is the ray-cast mask."""
    generator = torch.Generator().manual_seed(0)
    bodies = kitchen[::11][:10]
    for _ in range(3):
        rotation, translation = turned(10, generator), (torch.rand(10, 3, generator=generator) - 0.5) * 0.25
        angles = torch.rand(2, 2, generator=generator) * 360
        cameras = [Camera(float(a), float(e), 0.45, (0, 0, 0), projection) for a, e in angles]
        images = shot(bodies, rotation, translation, cameras, 256)
        for image, camera in zip(images, cameras, strict=True):
            assert iou((image >= 0.5).numpy(), cast_mask(bodies, rotation, translation, camera, 256)) >= 0.995


def test_shades_add_up_to_the_true_area(two_balls):
    """A disc of radius 1 covers pi square metres, however it lies on the pixels, soft or not."""
    outlines = silhouettes.Outlines(two_balls[:1], dtype=torch.float64)
    views = silhouettes.Views([Camera(0, 0, 4)], dtype=torch.float64)
    rotation = torch.eye(3, dtype=torch.float64)[None]
    for shift in torch.rand(10, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64) * 0.1:
        image = silhouettes.render(outlines, rotation, shift[None], views, 64)
        for soft in (0.0, 1.0, 3.0):
            area = silhouettes.soften(image, soft).sum() * (4 / 64) ** 2
            assert area.item() == pytest.approx(math.pi, rel=3e-3)


def test_the_soft_contour_is_centred_on_the_true_one():
    """A half plane's edge: blurred by whatever, it crosses one half at the edge itself (to a twentieth of a pixel)."""
    slab = trimesh.creation.box((4, 4, 4))
    body = make_body("slab", slab.vertices, slab.faces)
    for edge in (0.0, 0.013, 0.03, -0.021):
        image = shot([body], torch.eye(3)[None], torch.tensor([[edge - 2, 0, 0]]), [Camera(0, 0, 2)], 64)
        assert image[0, 32].sum().item() / 32 - 1 == pytest.approx(edge, abs=1e-6)
        for softness in (1.0, 4.0):
            row = silhouettes.soften(image, softness)[0, 32].numpy()
            place = np.interp(-0.5, -row[8:56], (np.arange(8, 56) + 0.5) / 32 - 1)
            assert place == pytest.approx(edge, abs=0.05 * 2 / 64), softness


def test_what_is_hidden_or_out_of_sight_has_no_gradient(two_balls):
    translation = torch.tensor([[0.0, 0, 0], [0.0, 3.0, 0]], requires_grad=True)
    small = [two_balls[0], two_balls[1].scaled(0.5)]
    shot(small, torch.eye(3).repeat(2, 1, 1), translation, [Camera(0, 0, 4)], 64).square().sum().backward()
    assert translation.grad[1].abs().max() == 0
    away = torch.tensor([[9.0, 0, 0], [0, 0, -9.0]], requires_grad=True)
    image = shot(small, torch.eye(3).repeat(2, 1, 1), away, [Camera(0, 0, 4)], 64)
    image.sum().backward()
    assert image.sum() == 0
    assert away.grad.abs().max() == 0


def test_bodies_across_the_border_are_cut_there(two_balls):
    image = shot(two_balls[:1], torch.eye(3)[None], torch.tensor([[-2.0, 0, 2.0]]), [Camera(0, 0, 4)], 128)[0]
    quarter = image.sum() * (4 / 128) ** 2
    assert quarter.item() == pytest.approx(math.pi / 4, rel=0.02)
    assert image[64:].sum() == 0, "row 0 is on top, column 0 on the left"
    assert image[:, 64:].sum() == 0


@pytest.mark.parametrize("rotation", ["angles", "quaternion"])
@pytest.mark.parametrize("projection", BOTH)
@pytest.mark.parametrize("softness", [1.0, 4.0])
def test_the_gradient_of_eq_2_is_that_of_central_differences(projection, softness, rotation):
    """Every pose parameter of three bodies, float64, three views of 128 x 128.

    A tip that enters or leaves a pixel's centre is a small jump; the step is short enough to meet none here.
    """
    generator = torch.Generator().manual_seed(2)
    bodies = [kitchen_like(6)[i] for i in (1, 3, 5)]
    cameras = [Camera(20, 15, 0.3, (0, 0, 0), projection), Camera(110, -10, 0.3), Camera(0, 80, 0.3)]
    outlines = silhouettes.Outlines(bodies, dtype=torch.float64)
    views = silhouettes.Views(cameras, dtype=torch.float64)
    size = 3 if rotation == "angles" else 4
    to_rotation = poses.angles_to_rotation if rotation == "angles" else poses.quaternion_to_rotation

    def draw(parameters):
        return silhouettes.render(outlines, to_rotation(parameters[:, :size]), parameters[:, size:], views, 128)

    def some(*scales):
        return torch.cat([torch.randn(3, n, generator=generator, dtype=torch.float64) * s for n, s in scales], 1)

    at = some((size, 1.0), (3, 0.03))
    targets = draw(at + some((size, 0.15), (3, 0.01))).detach()

    def loss(parameters):
        return losses.silhouette(draw(parameters), targets, softness)

    parameters = at.clone().requires_grad_()
    loss(parameters).backward()
    numeric = central_differences(loss, at, 1e-7)
    relative = (parameters.grad - numeric).abs() / numeric.abs().clamp(min=1e-3 * numeric.abs().max())
    assert relative.max() <= 1e-2


@pytest.mark.parametrize("projection", BOTH)
def test_a_body_off_its_target_is_pulled_back_from_all_sides(two_balls, projection):
    cameras = [
        Camera(azimuth, elevation, 6, (0, 0, 0), projection) for azimuth, elevation in ((0, 0), (90, 0), (0, 90))
    ]
    outlines, views = silhouettes.Outlines(two_balls[:1]), silhouettes.Views(cameras)
    targets = silhouettes.render(outlines, torch.eye(3)[None], torch.zeros(1, 3), views, 128)
    for direction in np.ndindex(3, 3, 3):
        off = torch.tensor(direction, dtype=torch.float32) - 1
        if off.abs().sum() == 0:
            continue
        place = (off / off.norm())[None].requires_grad_()
        losses.silhouette(silhouettes.render(outlines, torch.eye(3)[None], place, views, 128), targets, 8).backward()
        downhill = -place.grad[0]
        cosine = torch.dot(downhill, -off) / (downhill.norm() * off.norm())
        assert cosine > 0.95, direction


def test_softening_without_softness_changes_nothing():
    image = torch.rand(2, 8, 8)
    assert silhouettes.soften(image, 0) is image


def test_cost_follows_the_contours_not_bodies_times_pixels(two_balls):
    """What is cut is the contours' length in pixels: twice the pixels along an edge, twice the cuts."""
    outlines, views = silhouettes.Outlines(two_balls), silhouettes.Views(box_views(4, (0, 0, 0)))
    identity, place = torch.eye(3).repeat(2, 1, 1), torch.zeros(2, 3)
    cuts = []
    for resolution in (128, 256):
        pixels, _ = project(outlines, identity, place, views, resolution)
        view, edge, _, _ = contour_edges(outlines, identity, place, views)
        ends = pixels[view[:, None], outlines.edges[edge, :2]]
        cuts.append(len(silhouettes._cuts(ends[:, 0, 1], ends[:, 1, 1], resolution, None, "cuts")[0]))
    assert cuts[1] == pytest.approx(2 * cuts[0], rel=0.02)
