"""Convex pieces: a convex body itself, else a skin that is the body's surface and reaches nowhere out of it."""

import numpy as np
import pytest
import trimesh

from data_fetch import cad_like, kitchen_like, torus
from rasp_core.geometry.meshes import make_body
from rasp_core.physics import convex_pieces
from rasp_core.util import o3d


def test_a_convex_body_is_one_piece_and_two_blocks_are_two():
    block, other = trimesh.creation.box([0.1, 0.2, 0.3]), trimesh.creation.box([0.1, 0.2, 0.3])
    (piece,) = convex_pieces.convex_pieces(make_body("block", block.vertices, block.faces))
    assert len(piece) == 8
    other.apply_translation((0.3, 0, 0))
    both = trimesh.util.concatenate([block, other])
    assert len(convex_pieces.convex_pieces(make_body("two", both.vertices, both.faces))) == 2


@pytest.mark.parametrize("body", [kitchen_like(3)[2], cad_like(3)[0], torus(0.1, 0.03)], ids=["bowl", "cad", "ring"])
def test_a_skin_covers_the_surface_and_stays_in_the_body(body):
    pieces = convex_pieces.convex_pieces(body)
    edge = 2 * float(body.half_extents.max())
    assert len(pieces) > 50
    corners = np.concatenate(pieces)
    scene, tensor = o3d.caster([(body.solid_vertices, body.solid_faces)]), o3d.load().core.Tensor
    assert scene.compute_signed_distance(tensor(corners.astype(np.float32)), nsamples=5).numpy().max() < 2e-3 * edge
    middles = body.solid_vertices[body.solid_faces].mean(1)
    inside = np.zeros(len(middles), bool)
    for piece in pieces:
        hull = trimesh.PointCloud(piece).convex_hull
        offsets = (hull.face_normals * hull.triangles_center).sum(1)[:, None]
        inside |= (hull.face_normals @ middles.T <= offsets + 6e-3 * edge).all(0)
    assert inside.mean() > 0.99


def test_a_fine_surface_gets_a_coarser_skin():
    ring = trimesh.creation.torus(0.1, 0.03, major_sections=64, minor_sections=32)
    assert len(ring.faces) > convex_pieces.MOST_FACES
    assert len(convex_pieces.convex_pieces(make_body("ring", ring.vertices, ring.faces))) <= convex_pieces.MOST_FACES


def test_a_thin_wall_has_no_skin_beyond_its_other_side():
    outer, inner = trimesh.creation.box([0.1] * 3), trimesh.creation.box([0.1, 0.099, 0.099])
    inner.apply_translation((0.001, 0, 0))
    tray = trimesh.boolean.difference([outer, inner], engine="manifold")
    body = make_body("tray", tray.vertices, tray.faces)
    corners = np.concatenate(convex_pieces.convex_pieces(body))
    scene, tensor = o3d.caster([(body.solid_vertices, body.solid_faces)]), o3d.load().core.Tensor
    assert scene.compute_signed_distance(tensor(corners.astype(np.float32))).numpy().max() < 1e-4


def test_points_in_a_plane_have_no_hull():
    assert convex_pieces.hull_of(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]])) is None
    assert convex_pieces.hull_of(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])).volume == pytest.approx(
        1 / 6
    )
