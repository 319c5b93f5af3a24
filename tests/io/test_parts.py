"""Surfaces of a file are moved, joined and thinned without a change of shape."""

import numpy as np
import pytest
import trimesh

from rasp_core.io.parts import joined, placed, used_only


def volume(vertices, faces):
    return trimesh.Trimesh(vertices, faces, process=False).volume


@pytest.mark.parametrize("matrix", [np.diag([2.0, 3, 4, 1]), np.diag([-2.0, 3, 4, 1])])
def test_moved_surfaces_keep_their_outside(matrix):
    box = trimesh.creation.box()
    matrix[:3, 3] = 5, 6, 7
    vertices, faces = placed(box.vertices, box.faces, matrix)
    assert volume(vertices, faces) == pytest.approx(24)
    np.testing.assert_allclose(vertices, trimesh.transform_points(box.vertices, matrix))


def test_joined_ones_are_all_there():
    box = trimesh.creation.box()
    vertices, faces = joined([(box.vertices, box.faces), (box.vertices + 3, box.faces)])
    assert volume(vertices, faces) == pytest.approx(2)
    assert [len(x) for x in joined([])] == [0, 0]


def test_only_vertices_that_faces_name():
    vertices = np.arange(15.0).reshape(5, 3)
    kept, faces = used_only(vertices, np.array([[4, 1, 3]]))
    np.testing.assert_array_equal(kept[faces], vertices[[[4, 1, 3]]])
    assert len(kept) == 3
    assert used_only(vertices, np.array([[0, 1, 2], [2, 3, 4]]))[0] is vertices
