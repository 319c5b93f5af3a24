"""The device that a run is asked to use."""

from __future__ import annotations

import torch

from .errors import InputError


def resolve_device(name: str | torch.device) -> torch.device:
    """`auto` (a GPU where there is one), `cpu`, `cuda`, `cuda:1`, `mps`. Raises InputError where it is not there."""
    if str(name) == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    try:
        device = torch.device(name)
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError, NotImplementedError) as error:
        raise InputError(f"device {str(name)!r} is not available here; use auto or cpu") from error
    return device
