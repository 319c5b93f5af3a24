"""The compiled extrusion and contact terms against the plain torch ones, one start and several."""

import pytest
import torch

from data_fetch import cad_like, kitchen_like, torus
from rasp_core import losses, poses
from rasp_core.geometry import containers
from rasp_core.kernels import dispatch, surface_contact
from rasp_core.objective import find_neighbours
from rasp_core.problem import Settings
from rasp_core.scene import Scene

BOX = containers.box((0.25, 0.2, 0.2))
RING = containers.Container(torus(0.12, 0.05))
REACH = Settings(contact_margin=1e-3)


def crowd(container, starts: tuple[int, ...]):
    """Poses of 9 bodies, some beyond the walls."""
    scene = Scene(kitchen_like(6) + cad_like(3), container, container.views(), dtype=torch.float64)
    generator = torch.Generator().manual_seed(1)
    turns = 6 * torch.rand(*starts, 9, 3, generator=generator, dtype=torch.float64)
    return scene, turns, 0.3 * torch.rand(*starts, 9, 3, generator=generator, dtype=torch.float64) - 0.15


def rows(found) -> list:
    return sorted(map(tuple, found.tolist()))


def both_engines(loss, turns, place):
    """Value and gradients by each engine."""
    found = []
    for name in dispatch.ENGINES:
        with dispatch.use(name):
            angles, centre = turns.clone().requires_grad_(), place.clone().requires_grad_()
            value = loss(poses.angles_to_rotation(angles), centre)
            value.sum().backward()
            found.append((value.detach(), angles.grad, centre.grad))
    return found


@pytest.mark.parametrize("container", [BOX, RING])
@pytest.mark.parametrize("starts", [(), (3,)])
def test_extrusion(container, starts):
    scene, turns, place = crowd(container, starts)
    surface = scene.outlines.vertices, scene.outlines.vertex_body, scene.radius
    compiled, plain = both_engines(lambda r, t: losses.extrusion(container, *surface, r, t), turns, place)
    assert compiled[0].shape == starts
    for a, b in zip(compiled, plain, strict=True):
        assert torch.allclose(a, b, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", dispatch.ENGINES)
@pytest.mark.parametrize("starts", [(), (3,)])
def test_obstacles_have_no_neighbours_of_their_own(name, starts):
    scene, turns, place = crowd(BOX, starts)
    rotation = poses.angles_to_rotation(turns)
    with dispatch.use(name):
        every = find_neighbours(scene, rotation, place, REACH)
        scene.movers = 4
        some = find_neighbours(scene, rotation, place, REACH)
    wanted = [row for row in rows(every.touching) if row[1] % 9 < 4 or row[2] % 9 < 4]
    assert len(wanted) < len(every.touching)
    assert rows(some.touching) == wanted
    assert rows(some.by_wall) == [row for row in rows(every.by_wall) if row[1] % 9 < 4]


@pytest.mark.parametrize("container", [BOX, RING])
@pytest.mark.parametrize("starts", [(), (3,)])
def test_contact(container, starts):
    scene, turns, place = crowd(container, starts)
    rotation, found = poses.angles_to_rotation(turns), {}
    for name in dispatch.ENGINES:
        with dispatch.use(name):
            found[name] = find_neighbours(scene, rotation, place, REACH)
    near = found["auto"]
    assert rows(near.touching) == rows(found["torch"].touching)
    assert rows(near.by_wall) == rows(found["torch"].by_wall)
    assert len(near.touching) > 500
    assert len(near.by_wall) > 500
    margin = torch.linspace(0, 2e-3, 9, dtype=torch.float64)

    def loss(r, t):
        return surface_contact.contact(scene.stack, scene.samples, near, container, r, t, margin)

    compiled, plain = both_engines(loss, turns, place)
    assert compiled[0].shape == starts
    for a, b in zip(compiled, plain, strict=True):
        assert torch.allclose(a, b, rtol=1e-9, atol=1e-15)
