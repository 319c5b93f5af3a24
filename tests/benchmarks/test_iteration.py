"""Time one iteration, whole and in parts: `make bench`. Never part of the tests."""

import pytest
import torch
from cases import PAPER, case

from rasp_core import losses, objective, optimizer, query_points, silhouettes
from rasp_core.kernels import surface_contact
from rasp_core.problem import Settings

ROUNDS = 20  # iterations in a row


def whole(benchmark, objects=PAPER, views=3, **settings):
    """The time is that of ROUNDS iterations; `ms_per_iteration` says what one takes."""
    problem, scene, start = case(objects, views)
    arguments = (problem, Settings(iterations=ROUNDS, **settings), start)
    benchmark.pedantic(optimizer.optimize, arguments, {"scene": scene}, rounds=5, warmup_rounds=1)
    benchmark.extra_info["ms_per_iteration"] = round(1000 * benchmark.stats.stats.median / ROUNDS, 2)


@pytest.mark.benchmark(group="20 iterations: objects, points")
@pytest.mark.parametrize("points", [80_000, 512_000])
@pytest.mark.parametrize("objects", [12, 106, 400, 1600])
def test_objects(benchmark, objects, points):
    whole(benchmark, objects, query_points=points)


@pytest.mark.benchmark(group="20 iterations: objects, the points' spacing kept")
@pytest.mark.parametrize("objects", [106, 400, 1600])
def test_objects_and_points(benchmark, objects):
    whole(benchmark, objects, query_points=80_000 * objects // PAPER)


@pytest.mark.benchmark(group="20 iterations: 106 objects, views, pixels")
@pytest.mark.parametrize("pixels", [128, 256, 512])
@pytest.mark.parametrize("views", [3, 5])
def test_views_and_pixels(benchmark, views, pixels):
    whole(benchmark, views=views, resolution=pixels)


@pytest.fixture
def poses():
    """The paper's case, and its poses as variables."""
    _, scene, start = case()
    return scene, start.rotation.clone().requires_grad_(), start.translation.clone().requires_grad_()


@pytest.mark.benchmark(group="parts of one iteration")
def test_silhouettes_forward(poses, benchmark):
    scene, *place = poses
    benchmark(silhouettes.render, scene.outlines, *place, scene.views, 256)


@pytest.mark.benchmark(group="parts of one iteration")
def test_silhouettes_backward(poses, benchmark):
    scene, *place = poses
    image = silhouettes.render(scene.outlines, *place, scene.views, 256)
    benchmark(lambda: torch.autograd.grad(image, place, torch.ones_like(image), retain_graph=True))


@pytest.mark.benchmark(group="parts of one iteration")
def test_blurred_square_and_gradient(poses, benchmark):
    scene, *place = poses
    image = silhouettes.render(scene.outlines, *place, scene.views, 256).detach().requires_grad_()
    targets = scene.container_silhouettes(256)
    benchmark(lambda: torch.autograd.grad(losses.silhouette(image, targets, 8.0), image))


@pytest.mark.benchmark(group="parts of one iteration")
@pytest.mark.parametrize("term", losses.OVERLAP_TERMS)
def test_overlap_and_gradient(poses, benchmark, term):
    scene, *place = poses
    lattice = query_points.query_lattice(scene.container)
    benchmark(losses.overlap, scene.stack, scene.half, *place, lattice, term)


@pytest.mark.benchmark(group="parts of one iteration")
def test_extrusion_and_gradient(poses, benchmark):
    scene, *place = poses
    outlines = scene.outlines
    benchmark(losses.extrusion, scene.container, outlines.vertices, outlines.vertex_body, scene.radius, *place)


@pytest.mark.benchmark(group="parts of one iteration")
def test_contact_and_gradient(poses, benchmark):
    """The last stage's term, over neighbours that are kept for ten iterations."""
    scene, *place = poses
    near = objective.find_neighbours(scene, *place, Settings())
    benchmark(
        surface_contact.contact,
        scene.stack,
        scene.samples,
        near,
        scene.container,
        *place,
        torch.zeros_like(scene.radius),
    )


@pytest.mark.benchmark(group="parts of one iteration")
def test_neighbours(poses, benchmark):
    scene, *place = poses
    benchmark(objective.find_neighbours, scene, *place, Settings())


@pytest.mark.benchmark(group="parts of one iteration")
def test_optimiser_step(poses, benchmark):
    """Adam on the poses of 106 objects."""
    _, *place = poses
    for variable in place:
        variable.grad = torch.ones_like(variable)
    benchmark(torch.optim.Adam(place).step)
