"""Certificates against volumes known by hand."""

import numpy as np
import pytest
import trimesh

from data_fetch import torus
from rasp_core.exact.certificate import certify, pairs_of_boxes, placed_solid
from rasp_core.geometry.containers import Container, box
from rasp_core.geometry.meshes import make_body

CUBE = trimesh.creation.box((1, 1, 1))


def cubes(*places, names=None):
    bodies = [make_body(names[i] if names else f"cube{i}", CUBE.vertices, CUBE.faces) for i in range(len(places))]
    matrices = np.tile(np.eye(4), (len(places), 1, 1))
    matrices[:, :3, 3] = places
    return bodies, matrices


def test_faces_that_touch_are_fine():
    certificate = certify(*cubes((-0.5, 0, 0), (0.5, 0, 0), (0.5, 1, 0)), box((2, 3, 1)))
    assert certificate.holds
    assert certificate.worst_overlap == 0
    assert certificate.lines() == []


def test_overlaps_and_protrusions_have_their_volumes_worst_first():
    certificate = certify(*cubes((-0.5, 0, 0), (0.25, 0, 0), (0.25, 0.9, 0)), box((2, 2.2, 1)))
    assert not certificate.holds
    assert [(o.first, o.second) for o in certificate.overlaps] == [
        ("cube0", "cube1"),
        ("cube1", "cube2"),
        ("cube0", "cube2"),
    ]
    assert [o.volume for o in certificate.overlaps] == pytest.approx([0.25, 0.1, 0.025])
    (out,) = certificate.protrusions
    assert (out.body, out.fraction) == ("cube2", pytest.approx(0.3))
    assert certificate.overlap_volume == pytest.approx(0.375)
    assert "cube0 and cube1 overlap by 2.50e-01" in certificate.lines()[0]
    assert "cube2 sticks out" in certificate.lines()[-1]
    assert certificate.to_dict()["holds"] is False


def test_the_fraction_is_of_the_smaller_body_and_tolerated_up_to_the_tolerance():
    bodies, matrices = cubes((0, 0, 0), (0.7, 0, 0))
    bodies[1] = bodies[1].scaled(0.5)
    overlap = certify(bodies, matrices, box((9, 9, 9))).overlaps[0]
    assert overlap.fraction == pytest.approx(0.05 * 0.25 / 0.125)
    assert certify(bodies, matrices, box((9, 9, 9)), tolerance=0.2).holds


def test_a_turned_body_is_judged_as_it_lies():
    bodies, matrices = cubes((0, 0, 0))
    c = np.sqrt(0.5)
    matrices[0, :2, :2] = [[c, -c], [c, c]]
    assert certify(bodies, matrices, box((1.42, 1.42, 1))).holds
    assert not certify(bodies, matrices, box((1.2, 1.42, 1))).holds


def test_matrices_are_from_file_coordinates():
    body = make_body("far", CUBE.vertices + 7, CUBE.faces)
    matrix = np.eye(4)
    matrix[:3, 3] = -7
    assert np.array(placed_solid(body, matrix).bounding_box()) == pytest.approx([-0.5] * 3 + [0.5] * 3)


def test_the_hole_of_a_ring_is_outside():
    ring = Container(torus(2, 0.9))
    assert not certify(*cubes((0, 0, 0)), ring).holds
    assert certify(*cubes((2, 0, 0)), ring).holds


@pytest.mark.parametrize("count", [0, 1, 2, 400, 2500])
def test_pairs_of_boxes_are_those_that_all_comparisons_find(count):
    random = np.random.default_rng(count)
    low = random.uniform(0, (1, 1, 5), (count, 3)).round(2)  # some touch, which is no shared volume
    boxes = np.stack([low, low + random.uniform(0.01, 0.3, (count, 3)).round(2)], 1)
    meet = (boxes[:, None, 0] < boxes[None, :, 1]).all(-1) & (boxes[None, :, 0] < boxes[:, None, 1]).all(-1)
    assert pairs_of_boxes(boxes) == list(zip(*(x.tolist() for x in np.nonzero(np.triu(meet, 1))), strict=True))


def test_only_pairs_of_boxes_that_meet_are_tested():
    boxes = np.array([[[0, 0, 0], [1, 1, 1]], [[0.5, 0.5, 0.5], [2, 2, 2]], [[1, 0, 0], [2, 1, 1]]])
    assert pairs_of_boxes(boxes) == [(0, 1), (1, 2)]
    assert certify(*cubes((0, 0, 0), (5, 5, 5)), box((20, 20, 20))).pairs_tested == 0
