"""Mesh files: held to bounds, then read by the reader of their kind; nothing in them is lost in silence."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import numpy as np

from ..util.errors import MeshError
from .bounds import CHECKS, MAX_BYTES, MAX_NODES, MAX_SCENE, check_triangles
from .parts import MeshFile

READERS = {".stl": "stl", ".obj": "obj", ".off": "off", ".ply": "ply", ".glb": "glb", ".3mf": "threemf"}


def read(path: str | Path) -> bytes:
    """The bytes of a mesh file that keeps to the bounds.

    Raises MeshError naming the file where it cannot be read, is too large, promises more than it holds, contains
    itself, or names other files.
    """
    path = Path(path)
    try:
        if not path.is_file():  # a folder, or a device that never ends
            raise MeshError(
                f"{path}: {'a folder, and no mesh file' if path.is_dir() else 'no such file'}; check the path"
            )
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise MeshError(f"{path}: has {size >> 20} MiB, more than {MAX_BYTES >> 20}; simplify the mesh")
        data = path.read_bytes()
    except MeshError:
        raise
    except (OSError, ValueError) as error:
        words = getattr(error, "strerror", None) or str(error)
        raise MeshError(f"{path}: cannot be read ({words}); check the path") from error
    check = CHECKS.get(path.suffix.lower())
    if check is not None:
        _named(path, check, data)
    return data


def load(path: str | Path) -> MeshFile:
    """The parts of a mesh file, in the file's unit and as its scene places them; windings and vertices as they are.

    Coordinates may be NaN or infinite where the file has such. Raises MeshError naming the file, the reason and the
    remedy in one line, as `read` does, and where the file holds no triangles, or what its reader finds no sense in.
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise MeshError(f"{path}: not a mesh file; use one of {' '.join(READERS)}")
    data = read(path)
    with np.errstate(all="ignore"):  # coordinates that are no numbers are for the caller to refuse, by the part's name
        file = _named(path, import_module(f"{__package__}.{reader}").parse, data)
    _named(path, _check_size, file)
    return file


def _check_size(file: MeshFile) -> None:
    for part in file.parts:
        check_triangles(len(part.faces))
    check_triangles(sum(len(part.faces) for part in file.parts), MAX_SCENE)
    if len(file.parts) > MAX_NODES:
        raise MeshError(f"has more than {MAX_NODES:,} parts; save fewer in a file")


def _named(path: Path, step: Callable, given):
    """`step` of what is given, with the file's name before whatever it raises."""
    try:
        return step(given)
    except MeshError as error:
        raise MeshError(f"{path}: {' '.join(str(error).split())}") from error
    except Exception as error:  # no damage in a file may reach the user as a traceback
        words = " ".join(str(error).split())[:120] or type(error).__name__
        raise MeshError(f"{path}: cannot be read as a mesh ({words}); export it again") from error
