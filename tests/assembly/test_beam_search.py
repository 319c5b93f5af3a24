"""Poses of many parts against where they were cut out; a bowl, whose parts alone could be anywhere about its axis."""

import numpy as np
import pytest
import torch

from data_fetch import fracture, scatter, vessels
from rasp_core.assembly.beam_search import best_assembly, possible_assemblies, refine_together
from rasp_core.assembly.metrics import measure
from rasp_core.assembly.scored_poses import ScoredPose, stack
from rasp_core.geometry.containers import Container
from rasp_core.geometry.meshes import make_body
from rasp_core.poses import file_to_world
from rasp_core.util.errors import InputError


@pytest.fixture(scope="module")
def bowl():
    whole = vessels()[1]
    parts, back = scatter(fracture(whole, 3, seed=0))
    return Container(whole), parts, back


def test_neighbours_show_where_symmetric_parts_belong(bowl):
    whole, parts, back = bowl
    found = best_assembly(parts, whole, seed=0)
    rotation, translation = map(torch.from_numpy, stack(found))
    assert measure(parts, file_to_world(parts, rotation, translation), back).rotation.max() < 2
    assert min(pose.score for pose in found) > 0.6


def test_the_same_seed_gives_the_same_poses(bowl):
    whole, parts, _ = bowl
    first, second = (best_assembly(parts[:2], whole, seed=3) for _ in range(2))
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one.translation, other.translation)


def test_many_ways_within_a_hull_the_best_first(bowl):
    whole, parts, _ = bowl
    ways = possible_assemblies(parts[:2], whole, seed=0)
    assert len(ways) > 5
    assert all(len(way) == 2 for way in ways)


def test_parts_are_refined_together_and_the_largest_stays():
    whole = vessels()[3]
    parts = fracture(whole, 2, seed=1)
    true = [ScoredPose(np.eye(3), part.centre, 0.0) for part in parts]
    off = ScoredPose(np.eye(3), parts[1].centre + np.array([0.001, 0.001, -0.001]), 0.0)
    placed = refine_together(parts, Container(whole), [true[0], off])
    np.testing.assert_array_equal(placed[0].translation, true[0].translation)
    assert np.linalg.norm(placed[1].translation - true[1].translation) < 5e-4


def test_a_part_that_fits_nowhere_is_named(bowl):
    whole, parts, _ = bowl
    rod = make_body("rod", parts[0].vertices * [8, 0.1, 0.1], parts[0].faces)
    with pytest.raises(InputError, match="rod fits nowhere in the whole"):
        best_assembly([parts[0], rod], whole)
