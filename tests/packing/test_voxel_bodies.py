"""Bodies as voxels, beside their volumes and boxes."""

import numpy as np
import pytest
import trimesh

from rasp_core.geometry.containers import FreeBox
from rasp_core.geometry.meshes import make_body
from rasp_core.packing.voxel_bodies import choose_size, filled, in_runs, laid_out, whole, without_overhangs
from rasp_core.packing.voxel_correlation import Turned

VOXEL = 0.01


def body_of(mesh):
    return make_body("one", mesh.vertices, mesh.faces)


def block(*edges):
    return body_of(trimesh.creation.box(np.array(edges) * VOXEL))


def test_the_voxel_is_chosen_by_what_it_rounds():
    bodies, strip = [block(6, 6, 12), block(3, 6, 9)], FreeBox((0.08, 0.08, None))
    assert choose_size(bodies, strip, 0.0085) == pytest.approx(VOXEL, rel=0.01)


def test_voxels_are_as_much_as_the_body():
    ball = filled(body_of(trimesh.creation.icosphere(subdivisions=4, radius=0.1)), np.eye(3), VOXEL)
    assert ball.voxels.sum() * VOXEL**3 == pytest.approx(4 / 3 * np.pi * 0.1**3, rel=0.02)


def test_a_block_of_whole_voxels_is_these():
    turned = filled(block(2, 3, 4), np.eye(3), VOXEL)
    assert turned.voxels.shape == (2, 3, 4)
    assert turned.voxels.all()
    assert turned.centre == pytest.approx([0.01, 0.015, 0.02])


def test_what_is_thinner_than_a_voxel_has_one_layer():
    assert filled(block(6, 6, 0.2), np.eye(3), VOXEL).voxels.sum() == 36


def test_what_lies_under_an_overhang_is_taken():
    voxels = np.zeros((3, 1, 4), bool)
    voxels[:, 0] = [[1, 0, 0, 1], [0, 1, 0, 0], [1, 1, 0, 0]]
    found = without_overhangs(Turned(np.eye(3), voxels, np.ones(3)))
    assert found.voxels[:, 0].astype(int).tolist() == [[1, 1, 1, 1], [0, 1, 0, 0], [1, 1, 0, 0]]
    assert found.centre.tolist() == [1, 1, 1]


def test_runs_are_the_voxels():
    voxels = np.random.default_rng(0).random((5, 4, 7)) < 0.5
    voxels[2] = False
    found, again = in_runs(Turned(np.eye(3), voxels, np.zeros(3)), 4), np.zeros_like(voxels)
    for x, y, first, end in found.runs:
        assert not again[x, y, first:end].any()
        again[x, y, first:end] = True
    assert (again == voxels).all()
    for x in range(5):
        assert (found.runs[found.columns[x] : found.columns[x + 1], 0] == x).all()
    assert found.columns[-1] == len(found.runs)
    assert (found.below[..., 1:] - found.below[..., :-1] == voxels).all()


def test_bodies_lie_one_after_the_other():
    bodies = [in_runs(filled(block(*edges), np.eye(3), VOXEL), 4) for edges in ((2, 3, 4), (5, 1, 1))]
    found = laid_out(bodies)
    assert found.sizes.tolist() == [[2, 3, 4], [5, 1, 1]]
    assert (found.end - found.begin).tolist() == [6, 5]
    assert found.columns[found.columns_at[1] :].tolist() == [6, 7, 8, 9, 10, 11]
    assert found.below[found.below_at[1] :].tolist() == 5 * [0, 1]


def test_coarse_cells_are_means_of_voxels():
    found = in_runs(filled(block(6, 4, 4), np.eye(3), VOXEL), 4)
    assert found.coarse[:, 0, 0].tolist() == [1.0, 0.5]
    assert found.size.tolist() == [6, 4, 4]


def test_a_box_has_the_voxels_that_lie_in_it():
    assert whole(np.array([0.0301, 0.0399, 0.001]), VOXEL).tolist() == [3, 3, 1]
