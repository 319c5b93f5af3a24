"""Convex pieces cover the body, and little more; they are decomposed once."""

import numpy as np
import pytest
import trimesh

from data_fetch import cad_like, kitchen_like, torus
from rasp_core.physics import convex_pieces


@pytest.mark.parametrize("seed", range(3))
def test_convex_pieces_make_up_the_body(seed):
    whole = [kitchen_like(3)[2], cad_like(3)[0], torus(0.1, 0.03)][seed]
    hulls = [trimesh.PointCloud(piece).convex_hull for piece in convex_pieces.convex_pieces(whole)]
    assert sum(hull.volume for hull in hulls) == pytest.approx(whole.volume, rel=0.35)
    joined = np.concatenate([hull.vertices for hull in hulls])
    assert np.ptp(joined, axis=0) == pytest.approx(2 * whole.half_extents, rel=0.05)


def test_points_in_a_plane_have_no_hull():
    assert convex_pieces.hull_of(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]])) is None
    assert convex_pieces.hull_of(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])).volume == pytest.approx(
        1 / 6
    )


def test_what_was_decomposed_is_kept(tmp_path, monkeypatch):
    monkeypatch.setenv("RASP_CACHE", str(tmp_path))
    ring = torus(0.1, 0.03)
    first = convex_pieces.convex_pieces(ring)
    assert len(first) > 1
    monkeypatch.setattr(convex_pieces, "_decomposed", lambda body: pytest.fail("it is in the cache"))
    again = convex_pieces.convex_pieces(ring)
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))


def test_pieces_leave_nothing_of_the_body_out():
    ring = torus(0.1, 0.03)
    hulls = [trimesh.PointCloud(piece).convex_hull for piece in convex_pieces.convex_pieces(ring)]
    corners = 0.999 * np.asarray(ring.solid_vertices)
    inside = [(hull.face_normals @ corners.T <= offsets(hull)).all(0) for hull in hulls]
    assert np.any(inside, axis=0).mean() > 0.99


def offsets(hull):
    return (hull.face_normals * hull.triangles_center).sum(1)[:, None]
