"""Searches of a size that is known beforehand find what searches of any size find."""

import pytest
import torch

from data_fetch import kitchen_like
from rasp_core import losses, poses, query_points, silhouettes
from rasp_core.geometry import containers
from rasp_core.kernels import dispatch
from rasp_core.scene import Scene
from rasp_core.util import capacity
from rasp_core.util.capacity import Capacity


def random(seed, size):
    return torch.rand(size, generator=torch.Generator().manual_seed(seed))


def test_found_is_nonzero_and_says_what_is_real():
    room, mask = Capacity(), random(0, 500) < 0.3
    index, real = capacity.found(mask, "some")
    assert real is None
    assert index.tolist() == [i for i, each in enumerate(mask.tolist()) if each]
    with room.use():
        within, real = capacity.found(mask, "some")
    assert len(within) > len(index)
    assert within[real].tolist() == index.tolist()
    assert not within[~real].any()
    assert not room.exceeded()


def test_ranges_are_those_of_python():
    start, count = torch.tensor([5, 0, 7, 100]), torch.tensor([3, 0, 2, 4])
    expected = [
        (k, i) for k, (s, c) in enumerate(zip(start.tolist(), count.tolist(), strict=True)) for i in range(s, s + c)
    ]
    which, index, real = capacity.ranges(start, count, "ranges")
    assert real is None
    assert list(zip(which.tolist(), index.tolist(), strict=True)) == expected
    with Capacity().use():
        which, index, real = capacity.ranges(start, count, "ranges")
    assert list(zip(which[real].tolist(), index[real].tolist(), strict=True)) == expected
    assert set(zip(which[~real].tolist(), index[~real].tolist(), strict=True)) <= {(3, 100)}


def test_more_than_there_is_room_for_is_told_and_then_there_is_room():
    room, few, many = Capacity(), torch.zeros(9000, dtype=torch.bool), torch.ones(9000, dtype=torch.bool)
    with room.use():
        capacity.found(few, "some")
        assert not room.exceeded()
        index, real = capacity.found(many, "some")
        assert len(index) < 9000
        assert room.exceeded()
        index, real = capacity.found(many, "some")
        assert real.sum() == 9000
        assert not room.exceeded()


def test_without_a_search_nothing_is_exceeded():
    assert not Capacity().exceeded()


@pytest.mark.parametrize(
    "container", [containers.box((0.3, 0.25, 0.2)), containers.Container(kitchen_like(1)[0].scaled(5))]
)
def test_the_losses_are_the_same_with_room_to_spare(container):
    """Values and gradients of every term, from other poses than those that the room was measured at."""
    bodies = kitchen_like(10)
    scene = Scene(bodies, container, container.views(2.0), dtype=torch.float64)
    generator = torch.Generator().manual_seed(1)
    lattice = query_points.query_lattice(container, 8000, dtype=torch.float64)
    targets = scene.container_silhouettes(64)
    corners = scene.outlines.vertices, scene.outlines.vertex_body, scene.radius

    def terms(turns, place):
        rotation = poses.angles_to_rotation(turns)
        images = silhouettes.render(scene.outlines, rotation, place, scene.views, 64)
        return (
            losses.silhouette(images, targets, 2.0),
            losses.overlap(scene.stack, scene.half, rotation, place, lattice),
            losses.extrusion(container, *corners, rotation, place),
        )

    room = Capacity()
    for _ in range(3):
        turns = 6 * torch.rand(10, 3, generator=generator, dtype=torch.float64)
        place = container.random_points(10, generator).double()
        found = []
        for used in (None, room):
            at = turns.clone().requires_grad_(), place.clone().requires_grad_()
            with dispatch.use("torch"):
                if used is None:
                    values = terms(*at)
                else:
                    with used.use():
                        values = terms(*at)
                    if used.exceeded():
                        with used.use():
                            values = terms(*at)
                        assert not used.exceeded()
            gradients = [torch.autograd.grad(value, at, retain_graph=True) for value in values]
            found.append((values, gradients))
        (free, slopes), (fixed, same) = found
        assert all(torch.allclose(a, b, rtol=1e-12) for a, b in zip(free, fixed, strict=True))
        for ours, theirs in zip(slopes, same, strict=True):
            assert all(torch.allclose(a, b, rtol=1e-9, atol=1e-12) for a, b in zip(ours, theirs, strict=True))
