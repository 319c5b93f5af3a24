"""Boxes and meshes as containers."""

import numpy as np
import pytest
import torch
import trimesh
from oracles import central_differences

from data_fetch import torus
from rasp_core.geometry import containers
from rasp_core.util.errors import InputError, MeshError


def test_a_box_and_the_same_box_as_a_mesh_agree(tmp_path):
    trimesh.creation.box((0.3, 0.2, 0.4)).export(tmp_path / "box.ply")
    box, mesh = containers.box((0.3, 0.2, 0.4)), containers.from_mesh(tmp_path / "box.ply")
    assert (box.volume, mesh.volume) == (pytest.approx(0.024), pytest.approx(0.024))
    assert box.bounds == pytest.approx(mesh.bounds)
    points = (torch.rand(500, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64) - 0.5) * 0.33
    exact, baked = box.signed_distance(points)[0], mesh.signed_distance(points)[0]
    assert (exact - baked).abs().max() < 0.4 / 96


def test_a_boxes_gradient_is_exact():
    box = containers.box((0.3, 0.2, 0.4))
    points = (torch.rand(100, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64) - 0.5) * 0.6
    numeric = central_differences(lambda p: box.signed_distance(p)[0].sum(), points, 1e-8)
    assert (box.signed_distance(points)[1] - numeric).abs().max() < 1e-6


def test_a_ring_has_its_hole_outside():
    ring = containers.Container(torus(0.2, 0.08))
    values, _ = ring.signed_distance(torch.tensor([[0.0, 0, 0], [0.2, 0, 0], [0, -0.2, 0.05]]))
    assert values.numpy() == pytest.approx([0.12, -0.08, -0.03], abs=0.004)
    points = ring.random_points(1000, torch.Generator().manual_seed(0))
    around = np.linalg.norm(points.numpy()[:, :2], axis=1) - 0.2
    assert (np.hypot(around, points.numpy()[:, 2]) < 0.083).all()


def test_points_are_drawn_evenly_and_by_seed():
    box = containers.box((1, 2, 3))
    first, second = (box.random_points(4000, torch.Generator().manual_seed(1)) for _ in range(2))
    assert torch.equal(first, second)
    assert first.mean(0).abs().max() < 0.06
    assert first.std(0).numpy() == pytest.approx(np.array([1, 2, 3]) / np.sqrt(12), rel=0.03)


def test_a_box_is_seen_from_three_faces_and_a_mesh_from_five_sides():
    assert len(containers.box((1, 2, 3)).views()) == 3
    views = containers.Container(torus()).views()
    assert len(views) == 5
    assert all(view.width > 2 * (0.2 + 0.1) for view in views)


def test_the_command_lines_words_for_containers(tmp_path):
    assert containers.parse("box:0.32,0.32,0.30").size == pytest.approx([0.32, 0.32, 0.3])
    trimesh.creation.icosphere().export(tmp_path / "ball.stl")
    assert containers.parse(str(tmp_path / "ball.stl")).size is None


@pytest.mark.parametrize("text", ["box:1,2", "box:a,b,c", "box:", "box:0,1,1", "box:1,-1,1", "box:1,1,nan"])
def test_impossible_boxes_are_refused(text):
    with pytest.raises(InputError, match="box"):
        containers.parse(text)


def test_a_mesh_that_is_not_there_is_named():
    with pytest.raises(MeshError, match=r"gone\.stl"):
        containers.parse("gone.stl")


def test_views_may_be_chosen():
    ring = containers.Container(torus(), directions=[(10, 20), (100, -5)])
    assert [(view.azimuth_deg, view.elevation_deg) for view in ring.views()] == [(10, 20), (100, -5)]
    assert ring.views()[0].width > np.linalg.norm(np.ptp(ring.bounds, axis=0))
    with pytest.raises(InputError, match="at least one view"):
        containers.Container(torus(), directions=[])


@pytest.mark.parametrize(
    ("text", "edges"),
    [("auto", (2, 2, 2)), ("auto:cube", (2, 2, 2)), ("auto:4,2,*", (4, 2, 1)), ("auto:*,0.5,*", (4, 0.5, 4))],
)
def test_a_box_to_be_found_is_sized(text, edges):
    shape = containers.parse(text)
    assert shape.sized(8.0) == pytest.approx(np.array(edges))
    assert shape.cube == (text == "auto:cube")


@pytest.mark.parametrize("text", ["auto:1,2,3", "auto:1,*", "auto:ball", "auto:-1,1,*", "auto:nan,1,*", "auto:0,1,*"])
def test_a_box_that_cannot_be_found_is_refused(text):
    with pytest.raises(InputError, match="write auto, auto:cube"):
        containers.parse(text)


def test_views_are_as_wide_as_asked():
    for room in (
        containers.box((1, 2, 3)),
        containers.Container(torus()),
        containers.Container(torus(), None, [(1, 2)]),
    ):
        assert room.views(2.2)[0].width == pytest.approx(2 * room.views()[0].width)


@pytest.mark.parametrize("room", [containers.box((1, 2, 3)), containers.Container(torus(), None, [(10, 20)])])
def test_scaled_keeps_the_shape(room):
    large = room.scaled(10)
    assert large.volume == pytest.approx(1000 * room.volume)
    assert large.bounds == pytest.approx(10 * room.bounds)
    points = torch.tensor(np.random.default_rng(0).uniform(-0.3, 0.3, (20, 3))).float()
    assert large.signed_distance(10 * points)[0].numpy() == pytest.approx(
        10 * room.signed_distance(points)[0].numpy(), abs=1e-3
    )
    assert large.directions == room.directions


def test_edges_that_are_free_take_what_they_are_given():
    strip = containers.FreeBox((0.2, None, 0.1))
    assert strip.lengths(0.5).tolist() == [0.2, 0.5, 0.1]
    assert strip.lengths(np.array([1.0, 2.0, 3.0])).tolist() == [0.2, 2.0, 0.1]
