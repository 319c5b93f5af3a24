"""Polygons are cut into triangles of their own area and winding, whatever their shape."""

import numpy as np
import pytest
import trimesh

from rasp_core.io.polygons import triangulated
from rasp_core.util.errors import MeshError

L = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 3), (0, 3)]  # area 4
U = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]  # area 7
ARROW = [(0, 0), (2, -1), (0, 2), (-2, -1)]  # a quad with a notch, area 4
ON_EDGES = [(0, 0), (1, 0), (2, 0), (2, 2), (1, 2), (0, 2)]  # area 4
KEYHOLE = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)]  # area 12
TILT = trimesh.transformations.rotation_matrix(1.0, (1, 2, 3), (4, 5, 6))


@pytest.mark.parametrize("size", [1e-6, 1, 1e6])
@pytest.mark.parametrize(
    ("outline", "area"),
    [(L, 4), (U, 7), (ARROW, 4), (ON_EDGES, 4), (KEYHOLE, 12), ([(0, 0), (1, 0), (1, 2), (0, 2)], 2)],
)
def test_areas_and_windings(outline, area, size):
    n = len(outline)
    for shift in range(n):  # whichever corner comes first
        for turn in (1, -1):
            flat = np.roll(np.array(outline, float), shift, 0)[::turn] * size
            vertices = trimesh.transform_points(np.column_stack([flat, np.zeros(n)]), TILT)
            faces = triangulated(vertices, [n], range(n))
            assert len(faces) == n - 2
            assert len(np.unique(faces)) == n
            corners = vertices[faces]
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
            along = normals @ (TILT[:3, 2] * turn)
            assert along.min() > -1e-6 * area * size**2  # none is folded over
            assert along.sum() == pytest.approx(area * size**2)


def test_order_of_mixed_faces():
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 2, 0)], float)
    faces = triangulated(square, [3, 2, 4, 0, 5], [0, 1, 2, 3, 4, 0, 1, 2, 3, 0, 1, 2, 4, 3])
    assert faces[0].tolist() == [0, 1, 2]
    assert faces.shape == (6, 3)
    assert set(faces[1:3].ravel()) == {0, 1, 2, 3}
    assert set(faces[3:].ravel()) == {0, 1, 2, 3, 4}


def test_polygons_without_a_plane_are_fans():
    flat = np.zeros((5, 3))
    assert triangulated(flat, [5], range(5)).tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4]]
    assert triangulated(flat + np.nan, [5], range(5)).tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4]]
    assert triangulated(flat, [], []).shape == (0, 3)


@pytest.mark.parametrize("corner", [-1, 3])
def test_corners_that_are_not_there(corner):
    with pytest.raises(MeshError, match="vertices that are not there"):
        triangulated(np.eye(3), [3], [0, 1, corner])


def test_a_quad_that_is_not_flat_is_cut_where_less_area_is_made():
    vertices = np.array([[0, 0, 0], [1, 0, 1], [2, 0, 0], [1, 1.0, 1]])
    (first, second) = triangulated(vertices, np.array([4]), np.arange(4))
    assert {1, 3} <= set(first.tolist())
    assert {1, 3} <= set(second.tolist())
