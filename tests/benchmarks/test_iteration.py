"""Time one iteration and its parts: `make bench`. Never part of the tests.

The paper's size: 106 Kitchen objects (from the embedded set where the real pool is not at hand), 80,000 query points,
3 views of 256 x 256 pixels, all objects at random poses in IR-BPP's container.
"""

import os
from pathlib import Path

import pytest
import torch

from data_fetch import kitchen_like
from rasp_core import arrange, certify, containers, losses, silhouettes
from rasp_core.meshes import load_bodies
from rasp_core.problem import Problem, Settings, Start

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def case():
    folder = Path(os.environ.get("RASP_DATA_MIRROR") or ROOT.parent / "shared" / "data") / "kitchen"
    bodies = load_bodies([folder]) if folder.is_dir() else kitchen_like(106)
    box = containers.box((0.32, 0.32, 0.30))
    problem = Problem(bodies, box)
    scene = problem.scene()
    start = Start.random(bodies, box, 0)
    return problem, scene, start.rotation, start.translation


@pytest.fixture
def poses(case):
    return [case[2].clone().requires_grad_(), case[3].clone().requires_grad_()]


SETTINGS = Settings(iterations=20)


@pytest.mark.benchmark(group="iteration")
def test_whole_iteration(case, benchmark):
    """Median of 20 in a row, forward, backward and Adam's step."""
    problem, scene, rotation, translation = case
    start = Start(rotation, translation)
    benchmark.extra_info["per"] = "20 iterations"
    benchmark.pedantic(arrange.arrange, (problem, SETTINGS, start), {"scene": scene}, rounds=5, warmup_rounds=1)


@pytest.mark.benchmark(group="parts")
def test_silhouettes_forward(case, poses, benchmark):
    scene = case[1]
    benchmark(silhouettes.render, scene.outlines, *poses, scene.views, 256)


@pytest.mark.benchmark(group="parts")
def test_silhouettes_backward(case, poses, benchmark):
    scene = case[1]
    image = silhouettes.render(scene.outlines, *poses, scene.views, 256)
    benchmark(lambda: torch.autograd.grad(image, poses, torch.ones_like(image), retain_graph=True))


@pytest.mark.benchmark(group="parts")
def test_blurred_square(case, poses, benchmark):
    scene = case[1]
    image = silhouettes.render(scene.outlines, *poses, scene.views, 256).detach().requires_grad_()
    targets = scene.container_silhouettes(256)
    benchmark(lambda: torch.autograd.grad(losses.silhouette(image, targets, 8.0), image))


@pytest.mark.benchmark(group="parts")
@pytest.mark.parametrize("term", losses.OVERLAP_TERMS)
def test_overlap(case, poses, benchmark, term):
    """Value and gradient."""
    scene = case[1]
    lattice = losses.query_lattice(scene.container)
    benchmark(losses.overlap, scene.stack, scene.half, *poses, lattice, term)


@pytest.mark.benchmark(group="parts")
def test_extrusion(case, poses, benchmark):
    scene = case[1]
    outlines = scene.outlines
    benchmark(losses.extrusion, scene.container, outlines.vertices, outlines.vertex_body, scene.radius, *poses)


@pytest.mark.benchmark(group="once")
def test_certificate(case, benchmark):
    problem, _, rotation, translation = case
    matrices = arrange.file_to_world(problem.bodies, rotation, translation)
    benchmark.pedantic(certify.certify, (problem.bodies, matrices, problem.container), rounds=3)


@pytest.mark.benchmark(group="once")
def test_scene_from_cached_grids(case, benchmark):
    benchmark.pedantic(case[0].scene, rounds=3)
