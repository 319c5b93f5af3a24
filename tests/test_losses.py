"""Eq. 2-5 against slow, naive sums, finite differences, and what they are for."""

import numpy as np
import pytest
import torch
from oracles import numeric_force, total_force

from data_fetch import torus
from rasp_core import losses, poses, query_points, silhouettes
from rasp_core.geometry import containers
from rasp_core.scene import Scene
from rasp_core.util.errors import InputError

BOX = containers.box((0.3, 0.25, 0.2))


@pytest.mark.parametrize("softness", [0.0, 1.5, 9.0])
def test_eq_2_and_its_gradient_are_those_of_plain_autograd(softness):
    generator = torch.Generator().manual_seed(0)
    images = torch.rand(2, 24, 24, generator=generator, dtype=torch.float64, requires_grad=True)
    targets = torch.rand(2, 24, 24, generator=generator, dtype=torch.float64)
    plain = silhouettes.soften(images - targets, softness).square().mean()
    found = losses.silhouette(images, targets, softness)
    assert found.item() == pytest.approx(plain.item())
    assert torch.allclose(*(torch.autograd.grad(loss, images)[0] for loss in (found, plain)))
    if softness == 0:
        assert found.item() == pytest.approx(((images - targets) ** 2).sum().item() / (2 * 24 * 24))


def naive_overlap(scene, rotation, translation, lattice, at_least):
    """Eq. 3-4 by looking every object up at every point."""
    points = lattice.points()
    values = torch.stack(
        [
            scene.stack.sample(torch.full((len(points),), i), (points - translation[i]) @ rotation[i])[0]
            for i in range(len(rotation))
        ]
    )
    inside = values < 0
    counted = inside.sum(0) >= at_least
    if lattice.inside is not None:
        counted &= lattice.inside
    return -(values * inside).sum(0)[counted].sum()


@pytest.mark.parametrize(("term", "at_least"), [("shared", 2), ("as_printed", 1)])
@pytest.mark.parametrize("container", [BOX, containers.Container(torus(0.12, 0.05))])
def test_overlap_is_the_naive_sum(crowd, term, at_least, container):
    scene, turns, translation = crowd
    rotation = poses.angles_to_rotation(turns)
    lattice = query_points.query_lattice(container, 5000, dtype=torch.float64)
    found = losses.overlap(scene.stack, scene.half, rotation, translation, lattice, term)
    assert found > 0
    assert found.item() == pytest.approx(naive_overlap(scene, rotation, translation, lattice, at_least).item())


@pytest.mark.parametrize("term", losses.OVERLAP_TERMS)
def test_overlaps_gradient_is_that_of_central_differences(crowd, term):
    """A point that enters a body enters at depth 0: the default jumps only where a second body is deeper there."""
    scene, turns, translation = crowd
    lattice = query_points.query_lattice(BOX, 3000, dtype=torch.float64)

    def loss(rotation, place):
        return losses.overlap(scene.stack, scene.half, rotation, place, lattice, term)

    exact, numeric = total_force(loss, turns, translation), numeric_force(loss, turns, translation)
    assert (exact - numeric).norm() <= 1e-4 * numeric.norm()


def test_extrusion_is_the_naive_sum_and_its_gradient_exact(crowd):
    scene, turns, translation = crowd
    outlines = scene.outlines

    def loss(rotation, place):
        return losses.extrusion(
            BOX, outlines.vertices, outlines.vertex_body, scene.radius, rotation, place, epsilon=0.01
        )

    rotation = poses.angles_to_rotation(turns)
    body = outlines.vertex_body
    world = (rotation[body] @ outlines.vertices[:, :, None])[:, :, 0] + translation[body]
    assert loss(rotation, translation).item() == pytest.approx(
        BOX.signed_distance(world)[0].clamp(min=-0.01).sum().item()
    )
    exact, numeric = total_force(loss, turns, translation), numeric_force(loss, turns, translation)
    assert (exact - numeric).norm() <= 1e-4 * numeric.norm()


def test_extrusion_of_bodies_deep_inside_is_minus_epsilon_for_each_vertex(two_balls):
    room = containers.box((9, 9, 9))
    scene = Scene(two_balls, room, room.views())
    outlines = scene.outlines
    place = torch.zeros(2, 3, requires_grad=True)
    turn = torch.eye(3).repeat(2, 1, 1)
    loss = losses.extrusion(room, outlines.vertices, outlines.vertex_body, scene.radius, turn, place, 0.5)
    loss.backward()
    assert loss.item() == pytest.approx(-0.5 * len(outlines.vertices))
    assert place.grad.abs().max() == 0


def pushes(term, balls, apart):
    """Minus the gradient on each of two balls whose centres are `apart` metres from each other along x."""
    room = containers.box((8, 6, 6))
    scene = Scene(balls, room, room.views())
    lattice = query_points.query_lattice(room, 60_000)
    generator = torch.Generator().manual_seed(0)
    forces = []
    for _ in range(30):
        place = torch.tensor([[-apart / 2, 0, 0], [apart / 2, 0, 0]], requires_grad=True)
        shifted = lattice.shifted(torch.rand(3, generator=generator) - 0.5)
        turn = torch.eye(3).repeat(2, 1, 1)
        losses.overlap(scene.stack, scene.half, turn, place, shifted, term).backward()
        forces.append(-place.grad)
    return torch.stack(forces)


def test_the_default_term_separates_two_bodies(two_balls):
    force = pushes("shared", two_balls, 1.2)
    assert (force[:, 0, 0] < 0).all()
    assert (force[:, 1, 0] > 0).all()
    assert force[:, :, 1:].mean(0).abs().max() < 0.05 * force[:, :, 0].abs().mean()


def test_as_printed_is_noise_inside_the_container(two_balls):
    """The depth of a rigid body is the same wherever it lies: what is left is the lattice, with no direction.

    Over thirty shifts of the lattice the mean force is no more than chance makes of the scatter, and a small
    part of the default's; the same body across the container's border is rewarded for leaving.
    """
    printed, shared = pushes("as_printed", two_balls, 1.2), pushes("shared", two_balls, 1.2)
    chance = 4 * printed.std(0) / np.sqrt(len(printed))
    assert (printed.mean(0).abs() < chance).all()
    assert printed.mean(0).abs().max() < 0.05 * shared[:, 1, 0].mean()
    leaving = pushes("as_printed", two_balls, 7.6)
    assert (leaving[:, 1, 0] > 0).all()
    assert (leaving[:, 0, 0] < 0).all()


def test_unknown_terms_are_refused(crowd):
    scene, turns, translation = crowd
    with pytest.raises(InputError, match="unknown"):
        losses.overlap(
            scene.stack,
            scene.half,
            poses.angles_to_rotation(turns),
            translation,
            query_points.query_lattice(BOX),
            "both",
        )
