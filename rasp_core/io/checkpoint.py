"""A run's state on disk, written whole or not at all, so that an interrupted run can go on."""

from __future__ import annotations

from pathlib import Path

import torch

from ..util.errors import InputError
from .atomic_files import whole


def save(path: str | Path, identity: dict, state: dict) -> None:
    """Write plain values and tensors beside `path`, then move them into place. Raises OSError where it cannot.

    identity : plain values that say which run this is of.
    """
    with whole(path) as part, part.open("wb") as file:
        torch.save({"identity": identity, **state}, file)


def load(path: str | Path, identity: dict, device: torch.device) -> dict | None:
    """The state kept at `path`; None where there is none.

    Raises InputError where the file is damaged, or of a run of another identity.
    """
    if not Path(path).exists():
        return None
    try:
        state = torch.load(path, weights_only=True, map_location=device)
        found = state["identity"]
    except Exception as error:  # torch.load raises whatever the damage makes zipfile and pickle raise
        raise InputError(f"{path}: not a checkpoint of this kit, or damaged; delete it to start anew") from error
    if found != identity:
        raise InputError(f"{path}: a checkpoint of other settings or objects; delete it to start anew")
    return state
