"""Adam, step by step as `torch.optim.Adam` makes them, without what the making of one costs.

`torch.optim.Adam` loads torch's compiler (torch._dynamo, sympy and more than a thousand modules in all) only to tell it
to stay away. For a single object that takes longer than all iterations; the function that computes a step does not.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor
from torch.optim.adam import adam

BETAS, EPSILON = (0.9, 0.999), 1e-8  # torch's defaults


class Adam:
    """Moments of the gradients of `parameters`, leaf tensors that require gradients."""

    def __init__(self, parameters: Sequence[Tensor]):
        self.parameters = list(parameters)
        self.states = [
            {
                "step": torch.tensor(0.0, device=p.device),
                "exp_avg": torch.zeros_like(p),
                "exp_avg_sq": torch.zeros_like(p),
            }
            for p in self.parameters
        ]

    def zero_grad(self) -> None:
        """Forget the gradients."""
        for parameter in self.parameters:
            parameter.grad = None

    def tensors(self) -> list[Tensor]:
        """All that a step changes: parameters, moments, and how many steps were made."""
        return self.parameters + [value for state in self.states for value in state.values()]

    @torch.no_grad()
    def step(self, rates: Sequence[float | Tensor]) -> None:
        """Move the parameters down their gradients, each at a rate of its own; one without a gradient stays.

        Rates in tensors are for a GPU, where they may change between plays of a recorded step.
        """
        for parameter, state, rate in zip(self.parameters, self.states, rates, strict=True):
            if parameter.grad is None:
                continue
            adam(
                [parameter],
                [parameter.grad],
                [state["exp_avg"]],
                [state["exp_avg_sq"]],
                [],
                [state["step"]],
                amsgrad=False,
                capturable=parameter.is_cuda,
                beta1=BETAS[0],
                beta2=BETAS[1],
                lr=rate,
                weight_decay=0.0,
                eps=EPSILON,
                maximize=False,
            )

    def state_dict(self) -> dict:
        """The moments, laid out as `torch.optim.Adam` has them."""
        return {"state": dict(enumerate(self.states))}

    def load_state_dict(self, kept: dict) -> None:
        """Take over what `state_dict` gave, of this class or of `torch.optim.Adam`."""
        for index, state in kept["state"].items():
            for name, value in self.states[index].items():
                value.copy_(state[name])
