"""Registration against poses that are known: parts of wholes, where they were cut out."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from data_fetch import fracture, vessels
from rasp_core.assembly.registration import Part, PartialAssembly
from rasp_core.assembly.scored_poses import ScoredPose
from rasp_core.geometry.containers import Container
from rasp_core.geometry.meshes import make_body


@pytest.fixture(scope="module")
def broken():
    """A gravy boat, which is not symmetric about an axis, in two parts."""
    whole = vessels()[3]
    return Container(whole), [Part(body) for body in fracture(whole, 2, seed=1)]


def true(part):
    return ScoredPose(np.eye(3), part.body.centre, 0.0)


def test_a_part_is_found_where_it_was_cut_out(broken):
    whole, (large, _) = broken
    pose = PartialAssembly(whole).find_poses(large, np.random.default_rng(0))[0]
    assert not pose.differs(true(large), np.radians(2), 0.01 * 0.23)
    assert pose.score > 0.6


def test_with_its_neighbour_there_the_fracture_counts_too(broken):
    whole, (large, small) = broken
    alone, beside = PartialAssembly(whole), PartialAssembly(whole)
    beside.add(large, true(large))
    (pose,), (without,) = beside.refine(small, [true(small)]), alone.refine(small, [true(small)])
    assert pose.score > without.score + 0.03
    assert not pose.differs(true(small), np.radians(0.5), 5e-4)


def test_a_part_is_refined_from_nearby(broken):
    whole, (large, _) = broken
    off = ScoredPose(
        Rotation.from_rotvec([0.05, -0.04, 0.03]).as_matrix(), large.body.centre + np.array([3, -2, 2]) / 1000, 0.0
    )
    (pose,) = PartialAssembly(whole).refine(large, [off])
    assert not pose.differs(true(large), np.radians(0.5), 5e-4)


def brick(name, size, centre):
    mesh = trimesh.creation.box(size)
    return make_body(name, mesh.vertices + centre, mesh.faces)


def test_the_score_is_the_share_of_surface_on_the_boundary_less_what_is_outside():
    whole = Container(brick("whole", (0.2, 0.1, 0.1), (0, 0, 0)))
    left, right = (Part(brick(name, (0.1, 0.1, 0.1), (x, 0, 0))) for name, x in (("left", -0.05), ("right", 0.05)))
    assembly = PartialAssembly(whole)
    assert assembly.score(left, true(left)) == pytest.approx(5 / 6, abs=0.12)  # but along edges
    assert assembly.score(left, ScoredPose(np.eye(3), left.body.centre + 1.0, 0.0)) == pytest.approx(-2)
    assembly.add(right, true(right))
    assert assembly.score(left, true(left)) == pytest.approx(1, abs=0.15)
    # in the other's place: what is on its surface lies wrong way round, inside of nothing
    assert assembly.score(left, ScoredPose(np.eye(3), right.body.centre - [0.05, 0, 0], 0.0)) < 0.5


def test_several_poses_are_refined_as_each_alone(broken):
    whole, (large, small) = broken
    assembly = PartialAssembly(whole)
    assembly.add(large, true(large))
    nearby = [ScoredPose(np.eye(3), small.body.centre + np.array(step) / 1000, 0.0) for step in ([3, 0, 0], [0, -2, 2])]
    for pose, near in zip(assembly.refine(small, nearby), nearby, strict=True):
        (alone,) = assembly.refine(small, [near])
        np.testing.assert_allclose(pose.translation, alone.translation, atol=1e-9)
        assert pose.score == pytest.approx(alone.score)


def test_a_bound_is_not_matched(broken):
    whole, (large, small) = broken
    bound = PartialAssembly(whole, match_whole=False)
    assert bound.score(small, true(small)) == pytest.approx(0, abs=0.05)
    bound.add(large, true(large))
    assert 0.03 < bound.score(small, true(small)) < 0.5


def test_a_copy_goes_on_alone(broken):
    whole, (large, small) = broken
    assembly = PartialAssembly(whole)
    twin, points = assembly.copy(), len(assembly.boundary)
    twin.add(large, true(large))
    assert assembly.placed == []
    assert len(assembly.boundary) == points != len(twin.boundary)
    third = twin.copy()
    third.set_pose(0, ScoredPose(np.eye(3), large.body.centre + 0.01, 0.0))
    assert twin.score(small, true(small)) != pytest.approx(third.score(small, true(small)))
    assert twin.score(small, true(small)) == pytest.approx(twin.rescored(small, [true(small)])[0].score)


def test_the_boundary_is_what_nothing_covers(broken):
    """Where both parts have their places all is covered; one of them covers its own share, and bares its fracture."""
    whole, (large, small) = broken
    assembly = PartialAssembly(whole)
    area = whole.body.manifold.surface_area()
    assert len(assembly.boundary) == 4000
    assembly.add(large, true(large))
    # the whole's surface that is left is the small part's own, so much as is not its fracture
    fracture_area = (large.area + small.area - area) / 2
    left = (assembly.owner < 0).sum() / 4000 * area
    assert left == pytest.approx(small.area - fracture_area, rel=0.1)
    bared = (assembly.owner == 0).sum() / 600 * large.area
    assert bared == pytest.approx(fracture_area, rel=0.35)  # but along its edges, where it is near the surface
    # its normals are those that the other part's fracture must have
    inwards = (assembly.normals[assembly.owner == 0] * (small.body.centre - large.body.centre)).sum(1)
    assert (inwards < 0).mean() > 0.9
    assembly.add(small, true(small))
    assert len(assembly.boundary) < 0.02 * 4000


def test_poses_about_a_neighbour_touch_it(broken):
    whole, (large, small) = broken
    assembly = PartialAssembly(whole)
    assembly.add(large, true(large))
    found = assembly.find_poses(small, np.random.default_rng(0), touching=0)
    assert not found[0].differs(true(small), np.radians(2), 0.002)
    assert assembly.find_poses(small, np.random.default_rng(0), touching=1) == [], "no such part, so nothing to touch"


def test_a_part_too_large_for_the_whole_has_no_pose(broken):
    whole, (large, _) = broken
    giant = Part(large.body.scaled(3.0))
    assert PartialAssembly(whole).find_poses(giant, np.random.default_rng(0)) == []
