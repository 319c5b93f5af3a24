"""Broken things put back together, at the door."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..assembly.assemble import assemble as by_mesh
from ..assembly.assemble import assemble_by_silhouettes
from ..assembly.holes import Hole
from ..assembly.pieces_alone import assemble_alone
from ..geometry import containers
from ..geometry.cameras import Camera
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..io.images import read_silhouettes
from ..packing.result import finish
from ..problem import Settings
from ..util.errors import InputError
from .inputs import as_bodies
from .result import Result

AZIMUTHS_DEG, ELEVATIONS_DEG = (0, 90, 0), (0, 0, 90)  # front, side, top


@dataclass(frozen=True, repr=False)
class AssemblyResult(Result):
    """Parts where they belong. scores `(N,)`: how much of each part's surface is matched, or, from the pieces alone, of
    its creases; likeness `(K,)`: of the silhouettes to the given ones, None if none were; warnings : lines about
    doubtful places; holes : where pieces are missing, the largest first, None unless they were put together alone."""

    scores: np.ndarray
    likeness: np.ndarray | None
    warnings: Sequence[str]
    holes: Sequence[Hole] | None = None

    @property
    def overlap(self) -> float:
        """The volume that parts share, of theirs."""
        return self.certificate.overlap_volume / sum(body.volume for body in self.bodies)

    def fit(self) -> str:
        """How well the parts fit, in words."""
        name, fit = ("fit of their surfaces", self.scores) if self.holes is None else ("creases matched", self.scores)
        if self.likeness is not None:
            name, fit = "likeness", self.likeness
        return (
            f"{name}: {fit.mean():.1%} in the mean, {fit.min():.1%} at least; {self.overlap:.2%} of the volume shared"
        )

    def headline(self) -> str:
        """What it is, in one line."""
        doubts = f", {len(self.warnings)} warnings" if self.warnings else ""
        return f"Assembly of {len(self.bodies)} parts, {self.fit()}{doubts}"

    def table(self) -> dict[str, str]:
        """Its facts in words, for a small table."""
        rows = {"parts": str(len(self.bodies)), "fit": self.fit()}
        return rows | {f"warning {k + 1}": line for k, line in enumerate(self.warnings)}

    def record(self) -> dict:
        """Further entries of result.json."""
        return {
            "command": "assemble",
            "scores": {body.name: float(score) for body, score in zip(self.bodies, self.scores, strict=True)},
            "likeness": None if self.likeness is None else self.likeness.tolist(),
            "warnings": list(self.warnings),
            "holes": None if self.holes is None else [hole.to_dict() for hole in self.holes],
            "seconds": self.seconds,
        }


def assemble(
    parts: str | Path | Sequence[Body] | Sequence[str | Path],
    whole: str | Path | Container | Body | None = None,
    *,
    silhouettes: Sequence[str | Path] | np.ndarray | None = None,
    azimuths_deg: Sequence[float] | None = None,
    elevations_deg: Sequence[float] | None = None,
    width: float | None = None,
    seed: int = 0,
    progress: bool = False,
) -> AssemblyResult:
    """Find where the parts of a broken thing belong; their own poses do not matter.

    whole : the whole's mesh, or its file. silhouettes : instead of it, pictures of the whole or their files,
    `(K, H, H)` in [0, 1], row 0 on top, one for each of the views `azimuths_deg`, `elevations_deg` (by default 0 90 0
    and 0 0 90: front, side, top). width : of their edges, metres. With neither, the pieces alone are matched by the
    borders of their fractures; the largest one keeps the orientation of its file, and the container is a box about them
    all.
    Raises InputError if both are given, for parts that are not the whole's, and where no two pieces fit each other.

    >>> import rasp_core as rasp
    >>> from data_fetch import fracture, scatter, vessels
    >>> vessel = vessels()[0]
    >>> shards, truth = scatter(fracture(vessel, 2, seed=0), seed=0)
    >>> assembled = rasp.assemble(shards, vessel)
    >>> len(assembled.bodies), list(assembled.warnings)
    (2, [])
    """
    began = time.monotonic()
    if whole is not None and silhouettes is not None:
        raise InputError("the whole (a mesh) and its silhouettes were both given; give one of them, or neither")
    if silhouettes is None:
        for option, value in (("width", width), ("azimuths-deg", azimuths_deg), ("elevations-deg", elevations_deg)):
            if value is not None:
                raise InputError(f"--{option} is of silhouettes, and there are none; leave it out")
    if whole is None and silhouettes is None:
        bodies = as_bodies(parts)
        found = assemble_alone(bodies, seed, progress=progress)
    elif whole is not None:
        if isinstance(whole, str | Path):
            whole = containers.from_mesh(whole)
        room = Container(whole) if isinstance(whole, Body) else whole
        bodies = as_bodies(parts)
        found = by_mesh(bodies, room, seed, progress=progress)
    else:
        cameras = _cameras(len(silhouettes), azimuths_deg, elevations_deg, width)
        images = silhouettes if isinstance(silhouettes, np.ndarray) else read_silhouettes(silhouettes)
        bodies = as_bodies(parts)
        found = assemble_by_silhouettes(bodies, images, cameras, seed, progress=progress)
    drawn = finish(bodies, list(range(len(bodies))), found.poses, found.container, Settings(seed=seed))
    return AssemblyResult(
        arrangement=drawn.arrangement,
        certificate=drawn.certificate,
        seconds=time.monotonic() - began,
        scores=found.scores,
        likeness=found.likeness,
        warnings=found.warnings,
        holes=found.holes,
    )


def _cameras(
    count: int, azimuths_deg: Sequence[float] | None, elevations_deg: Sequence[float] | None, width: float | None
) -> list[Camera]:
    azimuths_deg = AZIMUTHS_DEG if azimuths_deg is None else azimuths_deg
    elevations_deg = ELEVATIONS_DEG if elevations_deg is None else elevations_deg
    if width is None:
        raise InputError("silhouettes need the pictures' width in metres; give --width")
    if not count == len(azimuths_deg) == len(elevations_deg):
        raise InputError(
            f"silhouettes need as many --azimuths-deg and --elevations-deg, got {len(azimuths_deg)} and "
            f"{len(elevations_deg)} for {count} pictures"
        )
    return [Camera(*angles, width) for angles in zip(azimuths_deg, elevations_deg, strict=True)]
