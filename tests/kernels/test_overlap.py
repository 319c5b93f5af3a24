"""The compiled overlap term against the plain torch one, value by value and gradient by gradient."""

import pytest
import torch

from data_fetch import cad_like, kitchen_like, torus
from rasp_core import losses, poses, query_points
from rasp_core.geometry import containers
from rasp_core.kernels import dispatch
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


def test_several_starts_give_what_each_gives():
    scene, turns, place = crowd(torch.float64)
    lattice = query_points.query_lattice(BOX, 20_000, dtype=torch.float64)
    rotation = poses.angles_to_rotation(torch.stack([turns, turns + 1]))
    centre = torch.stack([place, -place])
    found = []
    for name in dispatch.ENGINES:
        with dispatch.use(name):
            found.append(losses.overlap(scene.stack, scene.half, rotation, centre, lattice))
    alone = [losses.overlap(scene.stack, scene.half, r, t, lattice) for r, t in zip(rotation, centre, strict=True)]
    assert torch.equal(found[0], torch.stack(alone))
    assert torch.allclose(*found, rtol=1e-9)
