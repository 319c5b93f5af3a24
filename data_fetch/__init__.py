"""Data sets: the real ones by registry and hash, and procedural ones that need no network."""

from .drawn import portraits, shapes
from .fetchers import (
    fetch,
    fetch_blockout,
    fetch_cad,
    fetch_containers,
    fetch_fracture,
    fetch_general,
    fetch_kitchen,
    fetch_nesting,
    fetch_targets,
)
from .fractures import fracture, joined, scatter, vessels
from .nesting import nesting_instance
from .procedural import cad_like, duck, head, kitchen_like, polycubes, torus
from .scans import reconstruct

__all__ = [
    "cad_like",
    "duck",
    "fetch",
    "fetch_blockout",
    "fetch_cad",
    "fetch_containers",
    "fetch_fracture",
    "fetch_general",
    "fetch_kitchen",
    "fetch_nesting",
    "fetch_targets",
    "fracture",
    "head",
    "joined",
    "kitchen_like",
    "nesting_instance",
    "polycubes",
    "portraits",
    "reconstruct",
    "scatter",
    "shapes",
    "torus",
    "vessels",
]
