"""Points inside bodies: where they lie, and what they stand for."""

import numpy as np
import pytest
import trimesh
from scipy.ndimage import map_coordinates

from data_fetch import kitchen_like
from rasp_core.geometry.interior_points import LEAST_POINTS, interior_points
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.sdf import bake_cached


def test_points_lie_inside_on_a_lattice_and_stand_for_all_of_the_volume():
    bodies = kitchen_like(6)
    material = interior_points(bodies, 0.0025)
    for number, body in enumerate(bodies):
        own = material.body == number
        points = material.points[own].double().numpy()
        solid = trimesh.Trimesh(body.solid_vertices, body.solid_faces, process=False)
        grid = bake_cached(body)
        depth = map_coordinates(grid.values, ((points - grid.origin) / grid.spacing).T, order=1)
        assert (depth < grid.spacing).all()
        assert len(points) * 0.0025**3 == pytest.approx(solid.volume, rel=0.1)
        assert material.volume[own].double().sum().item() == pytest.approx(body.volume, rel=1e-5)
        steps = (points - points[0]) / 0.0025
        assert np.abs(steps - np.round(steps)).max() < 1e-3


@pytest.mark.parametrize("thickness", [5e-4, 1e-7])
def test_a_body_thinner_than_the_lattice_still_has_points(thickness):
    """Tilted, so that no plane of the lattice lies in it."""
    sheet = trimesh.creation.box((0.1, 0.1, thickness))
    sheet.apply_transform(trimesh.transformations.rotation_matrix(0.7, (1, 2, 0)))
    body = make_body("sheet", sheet.vertices, sheet.faces)
    material = interior_points([body], 0.02)
    assert len(material.points) >= LEAST_POINTS
    normal = sheet.face_normals[np.argmax(sheet.area_faces)]
    assert np.abs(material.points.double().numpy() @ normal).max() <= thickness / 2 + 1e-6
    assert material.volume.sum().item() == pytest.approx(body.volume, rel=1e-5)


def test_a_fine_lattice_has_all_of_its_points():
    """More than are tried at once, and more than a finer lattice of a thin body may have."""
    cube = trimesh.creation.box((0.1, 0.1, 0.1))
    material = interior_points([make_body("cube", cube.vertices, cube.faces)], 0.1 / 136)
    assert len(material.points) == 136**3
    assert len(np.unique(material.points[:, 0].numpy().round(6))) == 136
