"""Grown solids and shrunk containers against distances by other means."""

import manifold3d
import numpy as np
import pytest
import trimesh

from rasp_core.geometry import growing
from rasp_core.geometry.containers import Container, box
from rasp_core.geometry.growing import MOST_TRIANGLES, SPARE, ball, grown, shrunk
from rasp_core.geometry.meshes import make_body
from rasp_core.util import o3d
from rasp_core.util.errors import InputError


def body_of(mesh, name="body"):
    return make_body(name, mesh.vertices, mesh.faces)


def angle_iron():
    """An L of two plates, one concave piece."""
    outline = [(0, 0), (6, 0), (6, 1), (1, 1), (1, 5), (0, 5)]
    mesh = manifold3d.CrossSection([outline]).extrude(3.0).to_mesh64()
    return make_body("iron", np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts))


RING = body_of(trimesh.creation.torus(1.0, 0.4, major_sections=16, minor_sections=8))
TUBE = body_of(trimesh.creation.annulus(1.0, 1.5, 3.0, sections=20))


def least_distance(body, large):
    """From points spread over the grown surface to the body's, by open3d."""
    open3d = o3d.load()
    points = trimesh.Trimesh(large.solid_vertices, large.solid_faces).sample(20_000, seed=0) + large.centre
    scene = o3d.caster([(body.solid_vertices, body.solid_faces)])
    local = (np.concatenate([points, large.solid_vertices + large.centre]) - body.centre).astype(np.float32)
    return float(scene.compute_signed_distance(open3d.core.Tensor(local)).numpy().min())


def test_the_ball_has_its_faces_at_the_radius_and_one_across_each_axis():
    mesh = ball(2.0).to_mesh64()
    solid = trimesh.Trimesh(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts))
    away = (solid.face_normals * solid.triangles_center).sum(1)
    assert away == pytest.approx(2.0)
    assert np.ptp(solid.vertices, axis=0) == pytest.approx(4.0)
    assert len(np.unique(solid.face_normals.round(6), axis=0)) == 26


@pytest.mark.parametrize(
    ("body", "radius"),
    [
        (body_of(trimesh.creation.box((3, 2, 1))), 0.25),
        (angle_iron(), 0.3),
        (TUBE, 0.2),
        (body_of(trimesh.creation.icosphere(subdivisions=2)), 0.1),
        (RING, 0.2),
    ],
    ids=["box", "angle iron", "tube", "ball", "ring"],
)
def test_a_grown_solid_keeps_the_radius_and_little_more(body, radius, monkeypatch):
    monkeypatch.setattr(growing, "MOST_TRIANGLES", 150)  # the ring goes by the grid
    large = grown(body, radius)
    assert (large.core, large.growth, large.volume, large.name) == (body, radius, body.volume, body.name)
    assert least_distance(body, large) >= radius * (1 - 1e-4)  # open3d has 32 bits
    # the ball's corners are 1.13 radii out; no part of the surface is much farther
    beyond = np.abs(large.solid_vertices).max(0) - np.abs(body.solid_vertices).max(0)
    assert (beyond <= radius * 1.35).all()
    smooth = body.volume + radius * body.manifold.surface_area() + 4 * np.pi * body.half_extents.max() * radius**2
    assert large.manifold.volume() < 1.15 * smooth


def test_a_grown_block_is_a_block_along_its_edges():
    block = body_of(trimesh.creation.box((0.03, 0.02, 0.01)).apply_translation((1, 2, 3)))
    large = grown(block, 0.001)
    assert 2 * large.half_extents == pytest.approx(np.array([0.032, 0.022, 0.012]) + 2e-3 * SPARE, abs=1e-12)
    assert large.centre == pytest.approx((1, 2, 3))


def test_convex_pieces_of_a_file_are_grown_one_by_one_to_the_same_solid():
    pieces = [trimesh.creation.box((2, 1, 1)), trimesh.creation.box((1, 1, 3)).apply_translation((1.5, 0, 1))]
    apart = trimesh.util.concatenate(pieces)
    body = body_of(apart)
    welded = make_body("welded", body.solid_vertices + body.centre, body.solid_faces)
    one, other = grown(body, 0.2).manifold, grown(welded, 0.2).manifold
    assert one.volume() == pytest.approx(other.volume(), rel=1e-9)
    assert (one - other).volume() < 1e-9


def test_what_has_many_triangles_is_grown_by_fewer():
    fine = TUBE.manifold.refine(8)
    assert fine.num_tri() > MOST_TRIANGLES
    assert growing._coarse(fine, 0.2).num_tri() < MOST_TRIANGLES
    assert growing._coarse(TUBE.manifold, 0.2) is TUBE.manifold


def test_grown_solids_are_kept_and_damaged_ones_made_again(monkeypatch, tmp_path):
    monkeypatch.setenv("RASP_CACHE", str(tmp_path))
    body = body_of(trimesh.creation.box((3, 2, 1)))
    growing._cached.cache_clear()
    first = grown(body, 0.2)
    (kept,) = (tmp_path / "grown").iterdir()
    kept.write_bytes(b"damaged")
    growing._cached.cache_clear()
    assert grown(body, 0.2).digest == first.digest
    growing._cached.cache_clear()
    monkeypatch.setattr(growing, "_grow", lambda *_: pytest.fail("it is in the cache"))
    assert grown(body, 0.2).digest == first.digest


def test_a_box_is_shrunk_and_grown_and_keeps_its_views():
    room = box((0.3, 0.2, 0.1))
    assert shrunk(room, 0.01).size == pytest.approx((0.28, 0.18, 0.08))
    assert shrunk(room, -0.01).size == pytest.approx((0.32, 0.22, 0.12))
    assert shrunk(Container(room.body, room.size, [(0, 0)]), 0.01).directions == [(0, 0)]
    with pytest.raises(InputError, match=r"nothing of the container is 0.05 m from its wall"):
        shrunk(room, 0.05)


@pytest.mark.parametrize(("body", "margin"), [(angle_iron(), 0.3), (TUBE, 0.1), (RING, 0.1)])
def test_a_shrunk_mesh_lies_as_far_inside_as_asked(body, margin, monkeypatch):
    monkeypatch.setattr(growing, "MOST_TRIANGLES", 150)  # the ring goes by the grid
    room = Container(body)
    small = shrunk(room, margin)
    points = trimesh.Trimesh(small.body.solid_vertices, small.body.solid_faces).sample(5000, seed=0)
    open3d = o3d.load()
    scene = o3d.caster([(body.solid_vertices, body.solid_faces)])
    local = (points + small.body.centre - body.centre).astype(np.float32)
    depth = -scene.compute_signed_distance(open3d.core.Tensor(local)).numpy()
    assert depth.min() >= margin * (1 - 1e-4)
    assert depth.mean() <= 1.35 * margin
    with pytest.raises(InputError, match="ask for less wall clearance"):
        shrunk(room, body.half_extents.min())


def test_a_mesh_is_not_grown_by_a_negative_margin():
    room = Container(angle_iron())
    assert shrunk(room, -0.1) is room


@pytest.mark.parametrize("radius", [0.0, -0.1, np.nan, np.inf])
def test_what_does_not_grow_is_refused(radius):
    with pytest.raises(InputError, match="a body is grown by a positive length, got"):
        grown(RING, radius)


def test_a_grown_body_is_scaled_with_what_is_inside():
    large = grown(body_of(trimesh.creation.box((3, 2, 1))), 0.25)
    twice = large.scaled(2.0)
    assert twice.growth == 0.5
    assert twice.core.half_extents == pytest.approx([3, 2, 1])
    assert twice.half_extents == pytest.approx([3.5, 2.5, 1.5], rel=1e-3)
    assert twice.inside is twice.core
    assert not twice.core.grown
    assert twice.core.inside is twice.core
