"""Compiled look-ups of signed distances against the torch ones, inside of the grids and beyond them."""

import numpy as np
import pytest
import torch
from scipy import ndimage

from data_fetch import kitchen_like, torus
from rasp_core import poses
from rasp_core.geometry import containers
from rasp_core.geometry.sdf import GridStack, bake_cached
from rasp_core.kernels import grid

BODIES = kitchen_like(3)
POINTS = 0.3 * torch.rand(200, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64) - 0.15


@pytest.mark.parametrize("body", range(3))
def test_distances_and_slopes_are_those_of_the_stack(body):
    stack = GridStack.of_bodies(BODIES, dtype=torch.float64)
    value, slope = stack.sample(torch.full((200,), body), POINTS)
    far = (POINTS.abs() > torch.tensor(BODIES[body].half_extents)).any(1)
    assert 0 < far.sum() < 200
    for k, point in enumerate(POINTS.tolist()):
        found = grid.sample(stack.arrays, body, *point)
        assert found == pytest.approx([value[k].item(), *slope[k].tolist()], abs=1e-9)


@pytest.mark.parametrize("room", [containers.box((0.2, 0.25, 0.15)), containers.Container(torus(0.12, 0.05))])
def test_walls_are_those_of_the_container(room):
    value, slope = room.signed_distance(POINTS)
    assert 0 < (value < 0).sum() < 200
    wall = room.arrays(torch.float64)
    for k, point in enumerate(POINTS.tolist()):
        assert grid.wall_distance(wall, *point) == pytest.approx([value[k].item(), *slope[k].tolist()], abs=1e-9)


@pytest.mark.parametrize(
    ("position", "cell", "nearest"),
    [(2.25, (2, 0.25, 0), 2), (2.75, (2, 0.75, 0), 3), (-1.5, (0, 0, -1.5), 0), (4, (3, 1, 0), 4), (6, (3, 1, 2), 4)],
)
def test_cells_along_an_axis_of_five_values(position, cell, nearest):
    assert grid.cell_along(position, 5) == pytest.approx(cell)
    assert grid.nearest_along(position, 5) == nearest


def test_negative_places_are_those_of_an_affine_transform():
    """A turned lattice that sticks out of the grid on all sides, against scipy's."""
    own = bake_cached(BODIES[0]).values
    turn = (
        poses.quaternion_to_rotation(poses.random_quaternions(1, torch.Generator().manual_seed(0)))[0].double().numpy()
    )
    first = np.array(own.shape) / 2 - turn @ np.full(3, 40.0)
    found = np.empty((80, 80, 80), np.bool_)
    grid.negative(own, turn, first, found)
    depth = ndimage.affine_transform(own.astype(float), turn, first, (80, 80, 80), order=1, cval=1.0)
    differs = found != (depth < 0)
    assert 0.01 < found.mean() < 0.5
    assert np.abs(depth[differs]).max(initial=0) < 1e-9
