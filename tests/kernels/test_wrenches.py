"""Forces at points against autograd through the same points."""

import torch

from rasp_core import poses
from rasp_core.kernels import wrenches


def test_gathered_forces_are_the_gradient_of_a_linear_function_of_moved_points():
    generator = torch.Generator().manual_seed(0)

    def random(*shape):
        return torch.randn(*shape, generator=generator, dtype=torch.float64)

    body, point, force = torch.randint(0, 4, (50,), generator=generator), random(50, 3), random(50, 3)
    angles, translation = random(4, 3).requires_grad_(), random(4, 3).requires_grad_()

    def moved():
        rotation = poses.angles_to_rotation(angles)
        return rotation, (rotation[body] @ point[:, :, None])[:, :, 0] + translation[body]

    _, world = moved()
    expected = torch.autograd.grad((world * force).sum(), (angles, translation))

    rotation, world = moved()
    wrench = wrenches.gather(4, body, point, force)
    value = wrenches.differentiable(
        torch.tensor(3.0, dtype=torch.float64), rotation, translation, *wrenches.gradients(wrench)
    )
    found = torch.autograd.grad(2 * value, (angles, translation))
    assert value == 3
    assert all(torch.allclose(f, 2 * e) for f, e in zip(found, expected, strict=True))

    local = (rotation[body].transpose(1, 2) @ force[:, :, None])[:, :, 0]
    assert torch.allclose(wrenches.to_world(wrenches.gather(4, body, point, local), rotation), wrench)


def test_sums_in_steps_do_not_depend_on_the_order():
    generator = torch.Generator().manual_seed(1)
    index, values = torch.randint(0, 5, (4000,), generator=generator), torch.randn(4000, 2, generator=generator)
    order = torch.randperm(4000, generator=generator)
    found = wrenches.sum_in_steps(5, index, values, 2.0**-30)
    assert torch.equal(found, wrenches.sum_in_steps(5, index[order], values[order], 2.0**-30))
    exact = torch.zeros(5, 2, dtype=torch.float64).index_add_(0, index, values.double())
    assert torch.allclose(found.double(), exact, atol=1e-5)
