"""What bounding shapes share where bodies share nothing."""

import numpy as np
import pytest
import trimesh

from rasp_core.geometry.meshes import make_body
from rasp_core.visualize import proxies

BALL, CUBE = trimesh.creation.icosphere(4, 0.1), trimesh.creation.box([0.2] * 3)


def pair(mesh):
    return [make_body(name, mesh.vertices, mesh.faces) for name in "ab"]


def apart(distance):
    matrices = np.tile(np.eye(4), (2, 1, 1))
    matrices[1, :3, 3] = np.array([1.0, 0.0, 1.0]) * distance / np.sqrt(2)
    return matrices


def test_what_two_balls_share_is_a_lens():
    (lens,) = proxies.shared(pair(BALL), apart(0.15))
    deep = 0.1 - 0.075  # of each of its two caps
    assert lens.volume == pytest.approx(2 * np.pi * deep**2 * (0.3 - deep) / 3, rel=0.02)
    assert proxies.shared(pair(BALL), apart(0.21)) == []


def test_boxes_about_balls_meet_in_red_where_the_balls_do_not():
    def reds(picture):
        picture = picture.astype(int)
        return ((picture[..., 0] > picture[..., 1] + 60) & (picture[..., 0] > picture[..., 2] + 60)).sum()

    balls = pair(BALL)
    assert proxies.shared(balls, apart(0.22)) == []
    meets, clear = (proxies.enclosed(balls, pair(CUBE), apart(distance), (240, 200)) for distance in (0.22, 0.32))
    assert reds(proxies.overlapping(pair(BALL), apart(0.1), (240, 200))) > 200
    assert reds(proxies.overlapping(pair(BALL), apart(0.25), (240, 200))) == 0
    assert reds(meets) > reds(clear) + 100
