"""Signed distance grids against analytic shapes, winding numbers and direct queries."""

import numpy as np
import pytest
import torch
import trimesh
from oracles import central_differences, winding_number

from rasp_core import poses
from rasp_core.geometry import sdf
from rasp_core.geometry.meshes import make_body


@pytest.fixture(scope="module")
def block():
    mesh = trimesh.creation.box((0.1, 0.06, 0.04))
    return make_body("block", mesh.vertices, mesh.faces)


def surface_distance(body, points):
    import open3d

    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        open3d.core.Tensor(body.solid_vertices.astype(np.float32)),
        open3d.core.Tensor(body.solid_faces.astype(np.uint32)),
    )
    return scene.compute_distance(open3d.core.Tensor(points.astype(np.float32))).numpy()


def box_distance(points, half):
    beyond = np.abs(points) - half
    return np.linalg.norm(np.maximum(beyond, 0), axis=-1) + np.minimum(beyond.max(-1), 0)


def test_a_boxes_grid_is_its_distance(block):
    grid = sdf.bake(block.solid_vertices, block.solid_faces, cells=32)
    index = np.stack(np.meshgrid(*map(np.arange, grid.values.shape), indexing="ij"), -1)
    assert grid.values == pytest.approx(box_distance(grid.origin + grid.spacing * index, block.half_extents), abs=1e-6)


def test_sampling_is_trilinear_and_its_gradient_exact(block):
    stack = sdf.GridStack.of_bodies([block], dtype=torch.float64)
    points = (torch.rand(400, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64) - 0.5) * 0.12
    body = torch.zeros(400, dtype=torch.int64)
    inside = (points.abs() < torch.as_tensor(block.half_extents) + stack.spacing).all(1)
    value, gradient = stack.sample(body, points)
    truth = box_distance(points.numpy(), block.half_extents)
    assert value[inside].numpy() == pytest.approx(truth[inside], abs=float(stack.spacing[0]) / 2)
    numeric = central_differences(lambda p: stack.sample(body[inside], p)[0].sum(), points[inside], 1e-9)
    assert inside.sum() > 50
    assert (gradient[inside] - numeric).abs().max() < 1e-5


def test_beyond_the_grid_distance_and_gradient_point_outward(block):
    stack = sdf.GridStack.of_bodies([block], dtype=torch.float64)
    far = torch.tensor([[0.5, 0.0, 0.0], [0, -0.4, 0], [0.3, 0.3, 0.3]], dtype=torch.float64)
    value, gradient = stack.sample(torch.zeros(3, dtype=torch.int64), far)
    truth = box_distance(far.numpy(), block.half_extents)
    assert (value.numpy() >= truth - 1e-6).all()
    assert value[:2].numpy() == pytest.approx(truth[:2], rel=1e-3)
    assert gradient[:2].numpy() == pytest.approx(np.array([[1, 0, 0], [0, -1, 0]]), abs=1e-6)


def test_nearest_is_within_the_cells_half_diagonal(block):
    stack = sdf.GridStack.of_bodies([block, block])
    half = torch.as_tensor(block.half_extents, dtype=torch.float32) + stack.spacing[0]
    points = (2 * torch.rand(500, 3, generator=torch.Generator().manual_seed(1)) - 1) * half
    body = torch.arange(500) % 2
    difference = stack.nearest(body, points).numpy() - box_distance(points.numpy(), block.half_extents)
    assert np.abs(difference).max() < 0.87 * stack.spacing[0]


def test_equal_bodies_share_one_grid(block):
    assert len(sdf.GridStack.of_bodies([block] * 3).values) == len(sdf.GridStack.of_bodies([block]).values)
    assert sdf.GridStack([]).values.numel() == 0


def test_grids_come_from_the_cache_and_damage_is_mended(block, tmp_path, monkeypatch):
    monkeypatch.setenv("RASP_CACHE", str(tmp_path))
    first = sdf.bake_cached(block)
    (file,) = (tmp_path / "sdf").iterdir()
    monkeypatch.setattr(sdf, "bake", lambda *a: pytest.fail("the cache was not used"))
    assert np.array_equal(sdf.bake_cached(block).values, first.values)
    monkeypatch.undo()
    monkeypatch.setenv("RASP_CACHE", str(tmp_path))
    file.write_bytes(b"damaged")
    assert np.array_equal(sdf.bake_cached(block).values, first.values)
    assert np.array_equal(sdf.bake_cached(block).values, first.values)
    assert [f.suffix for f in (tmp_path / "sdf").iterdir()] == [".npz"]


def test_a_cache_that_cannot_be_written_is_done_without(block, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("RASP_CACHE", str(tmp_path / "file"))
    assert sdf.bake_cached(block).values.min() < 0


@pytest.mark.real_data
def test_no_sign_is_wrong_beyond_half_a_cell_on_any_kitchen_object(kitchen):
    """1,000 random points in each grid: the baked sign against winding numbers of the file's own surface."""
    rng = np.random.default_rng(0)
    stack = sdf.GridStack.of_bodies(kitchen)
    for i, body in enumerate(kitchen):
        spacing = float(stack.spacing[i])
        points = rng.uniform(-1, 1, (1000, 3)) * (body.half_extents + spacing)
        value = stack.sample(torch.full((1000,), i), torch.as_tensor(points, dtype=torch.float32))[0].numpy()
        inside = winding_number(points + body.centre, body.vertices, body.faces) > 0.5
        wrong = (value < 0) != inside
        if wrong.any():
            assert surface_distance(body, points[wrong]).max() <= spacing / 2, body.name


@pytest.mark.real_data
def test_the_warped_grid_is_the_moved_meshs_distance(kitchen):
    """A pose on the points is the inverse pose on the mesh: direct open3d queries of moved meshes agree."""
    import open3d

    generator = torch.Generator().manual_seed(0)
    rng = np.random.default_rng(0)
    stack = sdf.GridStack.of_bodies(kitchen)
    rotation = poses.quaternion_to_rotation(poses.random_quaternions(len(kitchen), generator))
    agree = total = 0
    for i in range(0, len(kitchen), 5):
        body, spacing, shift = kitchen[i], float(stack.spacing[i]), torch.tensor([0.1, -0.2, 0.3])
        local = torch.as_tensor(rng.uniform(-1, 1, (1000, 3)) * (body.half_extents + spacing), dtype=torch.float32)
        world = local @ rotation[i].T + shift
        value = stack.sample(torch.full((1000,), i), (world - shift) @ rotation[i])[0].numpy()
        moved = body.solid_vertices @ rotation[i].numpy().T.astype(float) + shift.numpy()
        scene = open3d.t.geometry.RaycastingScene()
        scene.add_triangles(
            open3d.core.Tensor(moved.astype(np.float32)), open3d.core.Tensor(body.solid_faces.astype(np.uint32))
        )
        truth = scene.compute_signed_distance(open3d.core.Tensor(world.numpy()), nsamples=11).numpy()
        assert np.abs(value - truth).max() <= spacing / 2, body.name
        away = np.abs(truth) > spacing
        agree += ((value < 0) == (truth < 0))[away].sum()
        total += away.sum()
    assert agree / total > 0.999
