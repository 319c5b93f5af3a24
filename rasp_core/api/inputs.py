"""What the door takes: objects from files, and containers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from ..geometry import containers
from ..geometry.containers import Container, FreeBox
from ..geometry.items import Item, bodies_of
from ..geometry.loading import METRES, Reading, load_bodies
from ..geometry.meshes import Body
from ..visualize import gltf

SCENE = "scene.glb"  # of a run's folder


def load(
    files: str | Path | Iterable[str | Path],
    *,
    unit: str = "m",
    repair: str = "close",
    together: bool = False,
    split: bool = False,
) -> list[Body]:
    """The solid objects in mesh files (.obj .stl .ply .off .glb .3mf), or in folders of them, sorted by name; metres.

    unit : of files that state none, mm, cm, m or inch; a 3MF states its own, a GLB is in metres. repair : "none"
    refuses a surface with holes, "close" closes small ones, "wrap" makes a solid of any sheet or soup. Parts of a file
    (build items of a 3MF, nodes of a GLB, objects of an OBJ, solids of an ASCII STL) are objects of their own, but
    together : one for each file; split : pieces that do not touch are objects, too.

    What was done to a file is in `body.notes` and a MeshWarning. Raises MeshError for a file that bounds no solid, and
    InputError for one that is not there.

    >>> import rasp_core as rasp, tempfile, trimesh
    >>> folder = tempfile.mkdtemp()
    >>> _ = trimesh.creation.box((0.1, 0.2, 0.3)).export(f"{folder}/brick.stl")
    >>> [brick] = rasp.load(folder)
    >>> brick.name, round(brick.volume, 6)
    ('brick', 0.006)
    """
    paths = [files] if isinstance(files, str | Path) else list(files)
    return load_bodies(paths, Reading(unit=unit, repair=repair, together=together, split=split))


def box(x: float, y: float, z: float) -> Container:
    """A container: a box of edges x, y, z in metres about the origin, z up. Raises InputError unless all are positive.

    >>> import rasp_core as rasp
    >>> rasp.box(0.3, 0.2, 0.2).volume
    0.012
    """
    return containers.box((x, y, z))


def as_bodies(parts: str | Path | Sequence[Body] | Sequence[str | Path] | Sequence[Item]) -> list[Body]:
    """Objects as they are, or from their files, or of items."""
    if isinstance(parts, str | Path):
        return load(parts)
    parts = list(parts)
    if any(isinstance(part, Item) for part in parts):
        return bodies_of([part if isinstance(part, Item) else Item(part) for part in parts])
    return parts if all(isinstance(part, Body) for part in parts) else load(parts)


def as_fixed(parts: str | Path | Sequence[Body] | Sequence[str | Path], reading: Reading = METRES) -> list[Body]:
    """Objects that stay where they are: as given, of a run's folder or its scene.glb, or of mesh files."""
    parts = [parts] if isinstance(parts, str | Path) else list(parts)
    bodies: list[Body] = []
    for part in parts:
        if isinstance(part, Body):
            bodies.append(part)
        elif (Path(part) / SCENE).exists() or Path(part).name == SCENE:
            bodies += gltf.read_scene(part)[0]
        else:
            bodies += load_bodies([part], reading)
    return [replace(body, wishes=replace(body.wishes, fixed=True)) for body in bodies]


def as_container(container: str | Path | Container | FreeBox) -> Container | FreeBox:
    """A container as it is, from its description as `containers.parse` has it, or from a mesh file."""
    return containers.parse(str(container)) if isinstance(container, str | Path) else container
