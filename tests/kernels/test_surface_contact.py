"""Surface contact against its naive sum, finite differences, and what it is for."""

import pytest
import torch
from oracles import numeric_force, total_force

from rasp_core import poses
from rasp_core.geometry import containers
from rasp_core.kernels import surface_contact
from rasp_core.objective import find_neighbours
from rasp_core.problem import Settings
from rasp_core.scene import Scene

BOX = containers.box((0.3, 0.25, 0.2))


def test_contact_is_the_naive_sum_and_its_gradient_exact(crowd):
    scene, turns, translation = crowd
    margin = torch.full((12,), 1e-3, dtype=torch.float64)
    rotation = poses.angles_to_rotation(turns)
    near = find_neighbours(scene, rotation, translation, Settings(contact_margin=1e-3))

    def loss(rotation, place):
        return surface_contact.contact(scene.stack, scene.samples, near, BOX, rotation, place, margin)

    samples = scene.samples
    own = torch.repeat_interleave(samples.count)
    world = (rotation[own] @ samples.points[:, :, None])[:, :, 0] + translation[own]
    naive = (samples.area * (BOX.signed_distance(world)[0] + 1e-3).clamp(min=0).square()).sum()
    for i in range(12):
        other = own != i
        value, _ = scene.stack.sample(torch.full((len(own),), i), (world - translation[i]) @ rotation[i])
        naive += (samples.area * (2e-3 - value).clamp(min=0).square())[other].sum()
    assert loss(rotation, translation).item() == pytest.approx(naive.item())
    exact, numeric = total_force(loss, turns, translation), numeric_force(loss, turns, translation)
    assert (exact - numeric).norm() <= 1e-4 * numeric.norm()


def test_an_overlap_thinner_than_the_query_points_spacing_is_seen(two_balls):
    """Two balls of radius 1 that share a lens 2 cm thick: pushed apart along the line of their centres."""
    room = containers.box((8, 8, 8))
    scene = Scene(two_balls, room, room.views(), dtype=torch.float64)
    turn = torch.eye(3, dtype=torch.float64).repeat(2, 1, 1)
    place = torch.tensor([[-0.99, 0, 0], [0.99, 0, 0]], dtype=torch.float64, requires_grad=True)
    near = find_neighbours(scene, turn, place.detach(), Settings())
    margin = torch.zeros(2, dtype=torch.float64)
    surface_contact.contact(scene.stack, scene.samples, near, room, turn, place, margin).backward()
    assert place.grad[0, 0] > 0 > place.grad[1, 0]
    assert place.grad[:, 1:].abs().max() < 0.3 * place.grad[0, 0]
