"""What a sculpture says of itself, for one whose likeness is counted by hand."""

import numpy as np
import pytest
import trimesh

from rasp_core.art.ceiling import hull_silhouettes
from rasp_core.art.sculpture import Sculpture
from rasp_core.exact.certificate import certify
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.containers import box
from rasp_core.geometry.meshes import make_body
from rasp_core.optimizer import Arrangement
from rasp_core.poses import Poses
from rasp_core.problem import Problem, Settings

SIDES = [Camera(0, 0, 1.0), Camera(90, 0, 1.0)]


@pytest.fixture
def made():
    """A cube of half the width, of which the pictures ask the left half and the lower quarter."""
    mesh = trimesh.creation.box((0.5,) * 3)
    room, start = (
        box((1.0, 1.0, 1.0)),
        Poses.random([cube := make_body("cube", mesh.vertices, mesh.faces)], box([1.0] * 3), 0),
    )
    pictures = np.zeros((2, 64, 64), bool)
    pictures[0, 16:48, 16:32] = True
    pictures[1, 40:48, 16:48] = True
    images = np.zeros((2, 64, 64), np.float32)
    images[:, 16:48, 16:48] = 1
    run = Arrangement(
        problem=Problem([cube], room, SIDES),
        settings=Settings(),
        rotation=start.rotation.double(),
        translation=start.translation.double(),
        images=images,
        targets=pictures.astype(np.float32),
        cameras=SIDES,
        history=np.zeros((0, 5)),
    )
    hull = hull_silhouettes(pictures, SIDES)
    return Sculpture(run, certify([cube], run.matrices, room), pictures, hull, rounds=[{"width": 1.0}])


def test_likeness_and_ceiling_are_those_counted(made):
    assert made.likeness == pytest.approx([1 / 2, 1 / 4])
    assert made.ceiling == pytest.approx([1 / 4, 1])
    assert made.of_ceiling == pytest.approx([1 / 8, 1 / 4])
    record = made.to_dict()
    assert record["likeness_of_ceiling"] == pytest.approx([1 / 8, 1 / 4])
    assert record["rounds"] == [{"width": 1.0}]


def test_it_warns_of_the_picture_that_the_other_does_not_allow(made):
    (line,) = made.warnings
    assert line.startswith(
        "the picture at azimuth 0, elevation 0 can be met to 25.0% at most; 24 of its rows are empty"
    )


def test_bodies_poses_and_matrices_are_those_of_the_arrangement(made):
    (cube,) = made.bodies
    assert made.container.size == pytest.approx([1.0] * 3)
    assert made.cameras == SIDES
    placed = cube.vertices @ made.poses.rotation[0].numpy().T + made.poses.translation[0].numpy()
    assert cube.vertices @ made.matrices[0, :3, :3].T + made.matrices[0, :3, 3] == pytest.approx(placed)
