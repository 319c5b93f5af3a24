"""The compiled loops over a part's surface against plain loops over `Container` and `GridStack`."""

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from data_fetch import fracture, vessels
from rasp_core.assembly.registration import Part, PartialAssembly
from rasp_core.assembly.scored_poses import ScoredPose
from rasp_core.geometry.containers import Container, box
from rasp_core.kernels.point_to_plane import Contact, coverage, normal_equations


def slow(assembly, part, pose, near, least):
    """Shares, square and slope of one pose, a point and a boundary at a time."""
    lies = leaves = rows = 0.0
    square, slope = np.zeros((6, 6)), np.zeros(6)
    for point, normal in zip(part.points, part.normals, strict=True):
        arm, turned = pose.rotation @ point, pose.rotation @ normal
        world, met = arm + pose.translation, []
        distance, gradient = assembly.whole.signed_distance(torch.from_numpy(world[None]).float())
        gradient = gradient[0].double().numpy()
        met.append(
            (distance.item(), gradient, turned @ gradient if assembly.match_whole else -1.0, distance.item() > 0)
        )
        for other, there in assembly.placed:
            local = there.rotation.T @ (world - there.translation)
            if other is part or (np.abs(local) >= other.body.half_extents + near).any():
                continue
            distance, gradient = other.signed_distance(local[None])
            gradient = there.rotation @ gradient[0]
            met.append((distance[0], gradient, -(turned @ gradient), distance[0] < 0))
        close = [abs(d) < near and cosine > least for d, _, cosine, _ in met]
        lies += max((1 - abs(met[k][0]) / near for k in range(len(met)) if close[k]), default=0.0)
        leaves += any(wrong and abs(d) >= near for d, _, _, wrong in met)
        for (distance, gradient, _, wrong), lying in zip(met, close, strict=True):
            if lying or wrong:
                row = np.concatenate([np.cross(arm, gradient), gradient])
                weight = 1 / (1 + (distance / near) ** 2)
                square += weight * np.outer(row, row)
                slope += weight * distance * row
                rows += 1
    return lies / len(part.points), leaves / len(part.points), rows, square, slope


@pytest.mark.parametrize("matched", [True, False])
@pytest.mark.parametrize("shape", ["mesh", "box"])
def test_many_poses_at_once(shape, matched):
    whole = vessels()[3]
    parts = [Part(body) for body in fracture(whole, 3, seed=1)]
    container = Container(whole) if shape == "mesh" else box(2.2 * whole.half_extents)
    assembly = PartialAssembly(container, matched)
    for part in parts[:2]:
        assembly.add(part, ScoredPose(np.eye(3), part.body.centre, 0.0))
    random = np.random.default_rng(0)
    for part in (parts[2], parts[1]):  # the second has its place already and does not meet itself
        turns = Rotation.from_rotvec(random.normal(size=(3, 3)) * 0.05).as_matrix()
        centres = part.body.centre + random.normal(size=(3, 3)) * 0.003
        for near in (0.002, 0.008):
            arguments = {**assembly._surfaces(part), "rotation": turns, "translation": centres}
            lies, leaves = coverage(**arguments, contact=Contact(distance=near, cosine=0.6))
            square, slope, rows = normal_equations(**arguments, contact=Contact(distance=near, cosine=0.6))
            for k in range(3):
                wanted = slow(assembly, part, ScoredPose(turns[k], centres[k], 0.0), near, 0.6)
                assert lies[k] == pytest.approx(wanted[0], abs=2e-3)
                assert leaves[k] == pytest.approx(wanted[1], abs=4e-3)  # a point more or less, by rounding
                assert rows[k] == pytest.approx(wanted[2], abs=2)
                np.testing.assert_allclose(square[k], wanted[3], rtol=0.02, atol=0.02 * np.abs(wanted[3]).max())
                np.testing.assert_allclose(slope[k], wanted[4], rtol=0.02, atol=0.02 * np.abs(wanted[4]).max())
