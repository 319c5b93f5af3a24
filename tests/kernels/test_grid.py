"""The compiled loops against the plain torch versions, value by value and gradient by gradient."""

import pytest
import torch

from data_fetch import cad_like, kitchen_like, torus
from rasp_core import contact, losses, poses, query_points, silhouettes
from rasp_core.geometry import containers
from rasp_core.kernels import dispatch
from rasp_core.objective import find_neighbours
from rasp_core.problem import Settings
from rasp_core.scene import Scene

BOX = containers.box((0.3, 0.25, 0.2))
RING = containers.Container(torus(0.12, 0.05))


def crowd(dtype):
    bodies = kitchen_like(12) + cad_like(10)
    generator = torch.Generator().manual_seed(0)
    turns = poses.rotation_to_angles(
        poses.quaternion_to_rotation(poses.random_quaternions(22, generator, torch.float64))
    )
    return Scene(bodies, BOX, BOX.views(), dtype=dtype), turns.to(dtype), BOX.random_points(22, generator).to(dtype)


@pytest.mark.parametrize("term", losses.OVERLAP_TERMS)
@pytest.mark.parametrize("container", [BOX, RING])
@pytest.mark.parametrize(("dtype", "tolerance"), [(torch.float64, 1e-9), (torch.float32, 1e-2)])
def test_overlap(term, container, dtype, tolerance):
    """In float32 a point at a body's surface may fall on the other side, which is worth a whole point's force."""
    scene, turns, place = crowd(dtype)
    lattice = query_points.query_lattice(container, 20_000, dtype=dtype).shifted(
        torch.tensor([0.1, 0.2, -0.3], dtype=dtype)
    )
    found = {}
    for name in dispatch.ENGINES:
        with dispatch.use(name):
            angles, centre = turns.clone().requires_grad_(), place.clone().requires_grad_()
            value = losses.overlap(scene.stack, scene.half, poses.angles_to_rotation(angles), centre, lattice, term)
            value.backward()
            found[name] = torch.cat([angles.grad, centre.grad], 1), value.detach()
    assert found["auto"][1].item() == pytest.approx(found["torch"][1].item(), rel=tolerance)
    assert (found["auto"][0] - found["torch"][0]).norm() <= tolerance * found["torch"][0].norm()


@pytest.mark.parametrize("softness", [0.4, 1.0, 8.0, 40.0])
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_blur(softness, dtype):
    images = torch.rand(2, 40, 48, generator=torch.Generator().manual_seed(0), dtype=dtype)
    with dispatch.use("torch"):
        expected = silhouettes.soften(images, softness)
    assert torch.allclose(silhouettes.soften(images, softness), expected, atol=1e-5)


def test_results_do_not_depend_on_the_number_of_threads():
    scene, turns, place = crowd(torch.float32)
    lattice = query_points.query_lattice(BOX, 20_000)
    rotation = poses.angles_to_rotation(turns)
    before, found = torch.get_num_threads(), []
    near = find_neighbours(scene, rotation, place, Settings())
    try:
        for threads in (1, 2, 3):
            torch.set_num_threads(threads)
            centre = place.clone().requires_grad_()
            value = losses.overlap(scene.stack, scene.half, rotation, centre, lattice)
            touch = contact.contact(scene.stack, scene.samples, near, BOX, rotation, centre, torch.zeros(22))
            image = silhouettes.render(scene.outlines, rotation, centre, scene.views, 128)
            again = find_neighbours(scene, rotation, place, Settings())
            (value + touch + image.square().sum()).backward()
            found.append((value.detach(), touch.detach(), image.detach(), centre.grad, again.touching, again.by_wall))
    finally:
        torch.set_num_threads(before)
    for other in found[1:]:
        assert all(torch.equal(a, b) for a, b in zip(found[0], other, strict=True))


def test_several_starts_give_what_each_gives():
    scene, turns, place = crowd(torch.float64)
    lattice = query_points.query_lattice(BOX, 20_000, dtype=torch.float64)
    rotation = poses.angles_to_rotation(torch.stack([turns, turns + 1]))
    centre = torch.stack([place, -place])
    targets = scene.container_silhouettes(96)
    found = []
    for name in dispatch.ENGINES:
        with dispatch.use(name):
            values = losses.overlap(scene.stack, scene.half, rotation, centre, lattice)
            images = silhouettes.render(scene.outlines, rotation, centre, scene.views, 96)
            found.append(torch.stack([values, losses.silhouette(images, targets, 2.0)]))
    alone = [losses.overlap(scene.stack, scene.half, r, t, lattice) for r, t in zip(rotation, centre, strict=True)]
    assert torch.equal(found[0][0], torch.stack(alone))
    assert torch.allclose(*found, rtol=1e-9)
