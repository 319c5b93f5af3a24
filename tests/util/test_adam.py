"""Adam's steps: those of torch.optim.Adam, bit for bit, without torch's compiler."""

import subprocess
import sys

import pytest
import torch

from rasp_core.util.adam import Adam

RATES = [[0.02, 0.01], [0.01, 0.005], [0.003, 0.03]]


def leaves(dtype):
    generator = torch.Generator().manual_seed(0)
    return [torch.rand(5, width, generator=generator, dtype=dtype).requires_grad_() for width in (4, 3)]


def descend(parameters, step, zero, rates):
    for each in rates:
        zero()
        first, second = parameters
        (first.sin().sum() * 3 + (first[:, :3] * second).square().sum()).backward()
        step(each)


def by_torch(parameters, kept=None):
    optimiser = torch.optim.Adam([{"params": [parameter]} for parameter in parameters])
    if kept is not None:
        optimiser.load_state_dict(kept)

    def step(rates):
        for group, rate in zip(optimiser.param_groups, rates, strict=True):
            group["lr"] = rate
        optimiser.step()

    return optimiser, step


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_steps_are_those_of_torch(dtype):
    own, other = leaves(dtype), leaves(dtype)
    adam, (optimiser, step) = Adam(own), by_torch(other)
    descend(own, adam.step, adam.zero_grad, RATES * 5)
    descend(other, step, optimiser.zero_grad, RATES * 5)
    assert not torch.equal(own[0], leaves(dtype)[0])
    for first, second in zip(own, other, strict=True):
        assert torch.equal(first, second)


def test_a_state_of_torch_is_taken_over():
    """As in checkpoints that were written with torch.optim.Adam."""
    other = leaves(torch.float32)
    optimiser, step = by_torch(other)
    descend(other, step, optimiser.zero_grad, RATES)
    own = [parameter.detach().clone().requires_grad_() for parameter in other]
    adam = Adam(own)
    adam.load_state_dict(optimiser.state_dict())
    descend(own, adam.step, adam.zero_grad, RATES)
    descend(other, step, optimiser.zero_grad, RATES)
    for first, second in zip(own, other, strict=True):
        assert torch.equal(first, second)


def test_what_has_no_gradient_stays():
    first, second = leaves(torch.float32)
    before = second.detach().clone()
    first.sum().backward()
    Adam([first, second]).step([0.1, 0.1])
    assert torch.equal(second, before)
    assert not torch.equal(first, leaves(torch.float32)[0])


def test_a_step_leaves_the_compiler_out():
    code = "import sys, torch; from rasp_core.util.adam import Adam; p = torch.ones(2, requires_grad=True); "
    code += "p.sum().backward(); Adam([p]).step([0.1]); print(p.tolist() != [1, 1], 'torch._dynamo' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "False"]
