"""The lattice of Eq. 3's points, and which bodies they lie in."""

import numpy as np
import pytest
import torch

from data_fetch import torus
from rasp_core import poses, query_points
from rasp_core.geometry import containers
from rasp_core.kernels import dispatch
from rasp_core.util.errors import InputError

BOX = containers.box((0.3, 0.25, 0.2))


def test_lattices_hold_about_the_points_asked_for_and_only_those_inside():
    assert query_points.query_lattice(BOX, 80_000).count == pytest.approx(80_000, rel=0.03)
    ring = containers.Container(torus(0.12, 0.05))
    lattice = query_points.query_lattice(ring, 20_000)
    assert lattice.count == pytest.approx(20_000, rel=0.03)
    around = np.linalg.norm(lattice.points()[lattice.inside].numpy()[:, :2], axis=1)
    assert around.min() > 0.06


@pytest.mark.parametrize("container", [BOX, containers.Container(torus(0.12, 0.05))])
def test_lattices_beyond_the_walls_are_as_close_and_hold_all_points(container):
    within = query_points.query_lattice(container, 20_000)
    wide = query_points.query_lattice(container, 20_000, volume=1.5)
    points, bounds = wide.points().numpy(), container.bounds
    assert wide.spacing == within.spacing
    assert np.allclose((points.min(0) + points.max(0)) / 2, bounds.mean(0), atol=1e-6)
    assert np.allclose(np.ptp(points, axis=0) + wide.spacing, 1.5 * np.ptp(bounds, axis=0), atol=wide.spacing)
    assert wide.inside is None
    assert wide.count == len(points)


def test_empty_lattices_are_refused():
    with pytest.raises(InputError, match="query point"):
        query_points.query_lattice(BOX, 0)


@pytest.mark.parametrize("name", dispatch.ENGINES)
def test_occupancy_counts_the_bodies_at_each_point(crowd, name):
    scene, turns, translation = crowd
    rotation, lattice = poses.angles_to_rotation(turns), query_points.query_lattice(BOX, 4000, dtype=torch.float64)
    points, naive = lattice.points(), torch.zeros(lattice.shape, dtype=torch.int64)
    for i in range(12):
        value, _ = scene.stack.sample(torch.full((len(points),), i), (points - translation[i]) @ rotation[i])
        within = ((points - translation[i]) @ rotation[i]).abs() <= scene.half[i]
        naive += ((value < 0) & within.all(1)).view(lattice.shape)
    with dispatch.use(name):
        found = query_points.occupancy(scene.stack, scene.half, rotation, translation, lattice)
        some = query_points.occupancy(
            scene.stack.take([3, 5]), scene.half[[3, 5]], rotation[[3, 5]], translation[[3, 5]], lattice
        )
    assert torch.equal(found.long(), naive)
    assert 0 < some.sum() < found.sum()
    assert (some <= found).all()
