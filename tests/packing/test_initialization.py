"""Starts: all objects in the container, and what each kind promises."""

import numpy as np
import pytest
import torch

from data_fetch import kitchen_like, torus
from rasp_core.exact.certificate import certify
from rasp_core.geometry.containers import Container, box
from rasp_core.packing import initialization
from rasp_core.poses import Poses, file_to_world
from rasp_core.util.errors import InputError

BODIES, BOX = kitchen_like(6), box((0.3, 0.3, 0.3))


@pytest.mark.parametrize("kind", initialization.STARTS)
@pytest.mark.parametrize("container", [BOX, Container(torus())], ids=["box", "mesh"])
def test_each_start_has_rotations_and_centres_inside(kind, container):
    start = initialization.make(kind, BODIES, container, seed=2)
    rotation = start.rotation.double()
    assert torch.allclose(rotation @ rotation.transpose(1, 2), torch.eye(3).double().expand(6, 3, 3), atol=1e-5)
    assert torch.allclose(torch.linalg.det(rotation), torch.ones(6).double(), atol=1e-5)
    assert (container.signed_distance(start.translation.float())[0] < 0).all()


def test_random_is_the_papers():
    start, expected = initialization.make("random", BODIES, BOX, seed=3), Poses.random(BODIES, BOX, 3)
    assert torch.equal(start.rotation, expected.rotation)
    assert torch.equal(start.translation, expected.translation)


def test_a_grid_keeps_centres_apart():
    start = initialization.make("grid", BODIES, BOX)
    distances = torch.cdist(start.translation, start.translation) + torch.eye(6)
    assert distances.min() > 0.8 * (BOX.volume / 8) ** (1 / 3)  # six of eight cells


@pytest.mark.parametrize("kind", ["gravity", "spectral"])
def test_placed_starts_hold_from_the_beginning(kind):
    start = initialization.make(kind, BODIES, BOX, seed=1)
    assert certify(BODIES, file_to_world(BODIES, start.rotation, start.translation), BOX).holds


def test_gravity_begins_on_the_floor_and_its_order_is_by_chance():
    one, other = (initialization.make("gravity", BODIES, BOX, seed=seed) for seed in (0, 1))
    assert not torch.equal(one.translation, other.translation)
    matrices = file_to_world(BODIES, one.rotation, one.translation)
    lowest = min(body.placed(matrix)[:, 2].min() for body, matrix in zip(BODIES, matrices, strict=True))
    assert lowest == pytest.approx(-0.15, abs=0.01)


def test_what_finds_no_room_stays_random():
    small = box((0.12, 0.12, 0.12))
    start, chance = initialization.make("spectral", BODIES, small), Poses.random(BODIES, small, 0)
    same = (start.translation.float() == chance.translation).all(1).numpy()
    assert np.any(same)
    assert not np.all(same)


def test_an_unknown_start():
    with pytest.raises(InputError, match=r"stack.*random, grid, gravity, spectral"):
        initialization.make("stack", BODIES, BOX)
