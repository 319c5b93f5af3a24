"""Both densities against volumes known by hand, and against each other."""

import numpy as np
import pytest
import trimesh

from rasp_core import density
from rasp_core.geometry.containers import box
from rasp_core.geometry.meshes import make_body
from rasp_core.util.errors import InputError

BALL = trimesh.creation.icosphere(subdivisions=4, radius=0.05)
BOX = box((0.3, 0.2, 0.25))


def balls(*places):
    matrices = np.tile(np.eye(4), (len(places), 1, 1))
    matrices[:, :3, 3] = places
    return [make_body(f"ball{i}", BALL.vertices, BALL.faces) for i in range(len(places))], matrices


def test_mesh_density_is_volumes_over_volume():
    bodies, _ = balls((0, 0, 0), (0, 0, 0))
    assert density.mesh_density(bodies, BOX) == pytest.approx(2 * BALL.volume / 0.015)


def test_voxels_converge_to_the_meshes_volume():
    bodies, matrices = balls((0.07, 0.01, 0), (-0.06, 0, 0.03))
    exact = density.mesh_density(bodies, BOX)
    errors = [abs(density.voxel_density(bodies, matrices, BOX, v) / exact - 1) for v in (0.01, 0.005, 0.002)]
    assert errors[2] < 0.01
    assert errors[2] < errors[0]


def test_shared_space_counts_once():
    bodies, matrices = balls((0, 0, 0), (0, 0, 0))
    assert density.voxel_density(bodies, matrices, BOX, 0.001) == pytest.approx(BALL.volume / 0.015, rel=0.05)


def test_what_sticks_out_of_the_lattice_is_cut_off():
    bodies, matrices = balls((5, 0, 0))
    assert density.voxel_density(bodies, matrices, BOX, 0.01) == 0


@pytest.mark.parametrize("voxel", [0, -1, float("nan")])
def test_voxels_need_an_edge(voxel):
    with pytest.raises(InputError, match="voxel"):
        density.voxel_density(*balls((0, 0, 0)), BOX, voxel)


@pytest.mark.real_data
def test_kitchen_voxels_agree_within_one_percent_at_two_millimetres(kitchen):
    """A loose heap without overlap: every tenth object, each on its own."""
    for body in kitchen[::10]:
        matrix = np.eye(4)[None].copy()
        matrix[0, :3, 3] = -body.centre
        container = box((0.32, 0.32, 0.30))
        exact = density.mesh_density([body], container)
        assert density.voxel_density([body], matrix, container, 0.002) == pytest.approx(exact, rel=0.01), body.name


@pytest.mark.parametrize("edge", [0.0003, 0.03, 30.0])
def test_a_block_that_fills_a_box_exactly(edge):
    """Its faces lie between voxels, and open3d finds them in neither."""
    mesh = trimesh.creation.box((edge,) * 3)
    block = make_body("block", mesh.vertices, mesh.faces)
    found = density.voxel_density([block], np.eye(4)[None], box((edge,) * 3), edge / 160)
    assert found == pytest.approx(1, rel=0.01)
