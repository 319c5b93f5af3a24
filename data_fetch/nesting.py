"""The open benchmark of 3D irregular strip packing: all parts in a box with a fixed base, as low as possible.

Its parts are published as voxels (github.com/Yifuwei/3D_irregular_packing_stream, MIT licence; instances by Stoyan et
al. 2004 and 2005, Egeblad et al. 2009, Liu et al. 2015, Lamas-Fernandez et al. 2022). A voxel is set where a part
touches it, so that the set is half a voxel too large all round, and the solids are rebuilt through the centres of the
outermost voxels. They are right to about a tenth of a voxel (voxels of 0.10 to 0.24, those of chess 1.02): a height
that beats another by less than half a per cent proves nothing.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import manifold3d
import numpy as np

from rasp_core.geometry.meshes import Body, make_body, unique_names
from rasp_core.util.errors import InputError

from .fetchers import fetch_nesting

SURFACE = 1 - 1e-6  # between 0 outside and 1 in a set voxel: as good as at its centre
CONVEX = 0.93  # of its convex hull that a convex part's rebuilt surface fills at least
SIMPLER = 0.3  # of a voxel, by which the surface of another part may move
FINER = ("_normal_", "_extrafine_")  # the lists of Merged name files of which there are finer ones
FLAT = 1e-4  # of a voxel: hulls' vertices that lie in one plane


@dataclass(frozen=True)
class Reported:
    """Heights that others report: sparrow-3d's best and mean (github.com/JonasTollenaere/sparrow-3d, 3 June 2026: 15
    seeds of 600 s, four workers of an Apple M5 Pro, turns in 4 steps about two axes, 8 for liu), and the best before
    it, None if there is none."""

    best: float
    mean: float
    before: float | None


INSTANCES: Mapping[str, tuple[str, Reported]] = {
    "chess": ("chess", Reported(99.45, 103.81, None)),
    "merged2": ("Merged2_normal", Reported(16.01, 17.0, 19.81)),
    "merged3": ("Merged3_normal", Reported(20.0, 20.07, 24.04)),
    "merged4": ("Merged4_normal", Reported(21.0, 21.97, 26.47)),
    "merged5": ("Merged5_normal", Reported(23.01, 23.86, 29.24)),
    "stoyan05_3": ("St_05_Example3_normal", Reported(22.73, 23.06, 24.91)),
    "stoyan04_4": ("st04_Example4_normal", Reported(43.04, 45.91, 54.83)),
    "stoyan04_5": ("st04_Example5_normal", Reported(54.43, 57.79, 72.33)),
    "liu": ("liu", Reported(22.0, 22.74, 34.13)),
}


@dataclass(frozen=True)
class Instance:
    """name; base `(2,)`, the box's edges along x and y; parts : names of voxel files and how many of each; lengths as
    the files have them."""

    name: str
    base: tuple[float, float]
    parts: Mapping[Path, int]
    reported: Reported

    @cached_property
    def bodies(self) -> list[Body]:
        """All parts, copies named `part#2`, ..."""
        solids = {path: rebuild(path) for path in self.parts}
        return unique_names([solids[path] for path, copies in self.parts.items() for _ in range(copies)])


def nesting_instance(name: str) -> Instance:
    """One of `INSTANCES`. Raises InputError for another name, FetchError where its files cannot be had."""
    if name not in INSTANCES:
        raise InputError(f"nesting instance {name!r} is unknown; use one of {', '.join(INSTANCES)}")
    list_name, reported = INSTANCES[name]
    files = {path.name: path for path in fetch_nesting()}
    text = files[f"{list_name}.txt"].read_text(encoding="utf-8")
    lines = [line.split() for line in text.splitlines() if line.strip()]
    base = float(lines[0][1]), float(lines[0][2])
    parts: dict[Path, int] = {}
    for place, copies in lines[1:]:
        part = place.rsplit("/", 1)[-1]
        path = files[part.replace(*FINER) if "/Merged/" in place else part]
        parts[path] = parts.get(path, 0) + int(copies)
    return Instance(name, base, parts, reported)


def rebuild(path: str | Path) -> Body:
    """A solid, named by its file, from a .binvox file of voxels, in the file's lengths, its lowest corner at 0.

    Where the surface through the outermost voxels' centres fills most of its hull, the hull is the solid. Raises
    InputError for what is no such file.
    """
    import trimesh
    from skimage.measure import marching_cubes

    path = Path(path)
    try:
        data = path.read_bytes()
        words = data[: data.index(b"data\n")].decode("ascii").split()
        pitch = float(words[words.index("scale") + 1]) / int(words[words.index("dim") + 1])
        full = np.asarray(trimesh.load(io.BytesIO(data), file_type="binvox").matrix, np.float32)
    except (OSError, ValueError, IndexError) as error:
        raise InputError(f"{path}: cannot be read as voxels; give a .binvox file") from error
    vertices, faces, _, _ = marching_cubes(np.pad(full, 1), SURFACE)
    mesh = manifold3d.Mesh64(np.ascontiguousarray(pitch * vertices, np.float64), np.ascontiguousarray(faces, np.uint64))
    solid = manifold3d.Manifold(mesh)
    hull = solid.hull()
    if abs(solid.volume()) >= CONVEX * hull.volume():
        solid = hull.simplify(FLAT * pitch)
    else:
        solid = solid.simplify(SIMPLER * pitch)
    mesh = solid.to_mesh64()
    vertices = np.asarray(mesh.vert_properties)[:, :3]
    stem = path.name.removesuffix(".binvox").removesuffix("_nh")
    return make_body(stem, vertices - vertices.min(0), np.asarray(mesh.tri_verts, np.int64))
