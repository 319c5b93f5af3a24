"""Data sets: the real ones by registry and hash, and procedural ones that need no network."""

from .fetchers import (
    fetch,
    fetch_blockout,
    fetch_cad,
    fetch_containers,
    fetch_fracture,
    fetch_general,
    fetch_kitchen,
    fetch_targets,
)
from .procedural import cad_like, kitchen_like, polycubes, torus

__all__ = [
    "cad_like",
    "fetch",
    "fetch_blockout",
    "fetch_cad",
    "fetch_containers",
    "fetch_fracture",
    "fetch_general",
    "fetch_kitchen",
    "fetch_targets",
    "kitchen_like",
    "polycubes",
    "torus",
]
