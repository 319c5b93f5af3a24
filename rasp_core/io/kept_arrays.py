"""Arrays that take long to make, kept on disk between runs under a hash of what they are made from."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import suppress

import numpy as np

from ..util.caches import cache_folder
from .atomic_files import whole


def kept(room: str, made_from: str, make: Callable[[], dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """The arrays that `make` returns, by name: from the cache where they are there, else made and put there.

    room : folder in the cache. made_from : words that are the same only where the arrays are. A cached file that cannot
    be read is made again; a cache that cannot be written is done without.
    """
    path = cache_folder() / room / f"{hashlib.sha256(made_from.encode()).hexdigest()[:32]}.npz"
    try:
        with np.load(path, allow_pickle=False) as data:
            return dict(data)
    except Exception:  # absent or damaged, whatever numpy and zipfile call it: both are mended by making them anew
        arrays = make()
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as part, part.open("wb") as file:
            np.savez(file, **arrays)
    return arrays
