"""Poses to start from, beside the paper's random ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..poses import Poses
from ..query_points import query_lattice
from ..util.errors import InputError
from .constructive import Placement

PLACED = {"gravity": "heightmap", "spectral": "spectral"}  # starts that a baseline makes, and its rule
STARTS = ("random", "grid", *PLACED)


def make(kind: str, bodies: Sequence[Body], container: Container, seed: int = 0) -> Poses:
    """Poses of all bodies. Raises InputError for an unknown kind.

    kind : "random", as `Poses.random`; "grid", turned at random, their centres on a lattice in the container, as widely
    spaced as gives all of them a point; "gravity", dropped from above one after the other in a random order;
    "spectral", placed where they lie most snugly, the largest first. What the last two find no room for stays random.
    """
    if kind not in STARTS:
        raise InputError(f"start {kind!r} is unknown; use one of {', '.join(STARTS)}")
    start = Poses.random(bodies, container, seed)
    if kind == "random":
        return start
    if kind == "grid":
        return _on_a_grid(start, container, seed)
    placement = Placement(bodies, container, seed, PLACED[kind])
    placement.fill(placement.shaken(np.inf if kind == "gravity" else 0.0))
    index, placed = list(placement.placed), placement.poses
    rotation, translation = start.rotation.double(), start.translation.double()
    rotation[index], translation[index] = placed.rotation.double(), placed.translation.double()
    return Poses(rotation, translation)


def _on_a_grid(start: Poses, container: Container, seed: int) -> Poses:
    wanted = len(start.translation)
    spots, count = [], wanted
    while len(spots) < wanted:
        lattice = query_lattice(container, count)
        spots = lattice.points() if lattice.inside is None else lattice.points()[lattice.inside]
        count += 1
    chosen = np.random.default_rng(seed).permutation(len(spots))[:wanted]
    return Poses(start.rotation, spots[chosen].to(start.translation.dtype))
