"""Save a run's folder.

scene.glb : one node for each body, named as the body, and one node `container`; metres, world z up.
result.json : poses, volumes, density both ways, certificate, last losses, views, settings, seed, versions, device.
history.csv : every loss at every iteration. silhouettes.png : target, rendered, difference for each view.
run.html : where it was recorded, the run as a page. load.html : where it comes apart, how it is loaded.
"""

from __future__ import annotations

import csv
import json
import os
import platform
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

import numpy as np
from PIL import Image

from ..art.texturing import Painted
from ..exact.certificate import Certificate
from ..geometry.meshes import Body
from ..io.exports import WRITERS, PlacedPart
from ..objective import LOSS_NAMES
from ..optimizer import Arrangement
from ..util.errors import InputError
from ..visualize import plots
from ..visualize.gltf import write_scene

RECORD, PART = "result.json", ".part-"
BOXES, BOXES_TABLE = "boxes.json", "boxes.csv"  # of a run of several boxes, each in a folder of its own
PACKAGES = ("torch", "numpy", "numba", "trimesh", "manifold3d", "open3d")


def check_writable(folder: str | Path) -> Path:
    """The folder's path, if a run can be saved there. Raises InputError naming it otherwise; creates nothing."""
    folder = Path(folder)
    parent = folder
    while not parent.exists():
        parent = parent.parent
    if not parent.is_dir():
        raise InputError(f"{folder}: cannot be written, {parent} is a file; name another folder with --out")
    try:
        with tempfile.TemporaryFile(dir=parent):
            pass
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}); name another folder with --out") from error
    return folder


def save_run(
    folder: str | Path,
    arrangement: Arrangement,
    certificate: Certificate,
    facts: dict,
    history: np.ndarray | None = None,
    scenes: Mapping[str, np.ndarray] | None = None,
    images: Mapping[str, np.ndarray] | None = None,
    painted: Painted | None = None,
    pages: Mapping[str, str] | None = None,
    exports: Sequence[str] = (),
    files: Mapping[str, Callable[[Path], object]] | None = None,
) -> Path:
    """Write a run's folder; each file appears whole or not at all, and what an earlier run had besides goes.

    facts : further entries of result.json. history : `(I, 5)` losses, the arrangement's own where None.
    scenes : further scenes' file names, and the poses `(N, 4, 4)` that the bodies have in them. images : further
    pictures' file names, and pixels uint8. painted : the bodies' colours in scene.glb. pages : further pages' file
    names, and their HTML. exports : formats of `io.exports.WRITERS`, each a file `parts.FORMAT`.
    files : further files' names, and what writes each to a path.
    Raises InputError where the folder cannot be written.
    """
    folder = check_writable(folder)
    history = arrangement.history if history is None else history
    made = not folder.exists()
    folder.mkdir(parents=True, exist_ok=True)
    for left in folder.glob(f"{PART}*"):  # by a run that was killed while it wrote
        shutil.rmtree(left, ignore_errors=True)
    work = Path(tempfile.mkdtemp(dir=folder, prefix=PART))
    try:
        bodies, container = arrangement.problem.bodies, arrangement.problem.container
        write_scene(work / "scene.glb", bodies, arrangement.matrices, container, painted)
        for name, matrices in (scenes or {}).items():
            write_scene(work / name, bodies, matrices, container)
        for word in exports:
            WRITERS[word](work / f"parts.{word}", _placed_parts(bodies, arrangement.matrices))
        for name, write in (files or {}).items():
            write(work / name)
        with (work / "history.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["iteration", *LOSS_NAMES])
            writer.writerows([i, *map(float, row)] for i, row in enumerate(history))
        for name, pixels in (images or {}).items():
            Image.fromarray(pixels).save(work / name)
        for name, text in (pages or {}).items():
            (work / name).write_text(text, encoding="utf-8")
        figure = plots.silhouette_figure(arrangement.targets, arrangement.images, arrangement.cameras)
        figure.savefig(work / "silhouettes.png", dpi=100)
        record = {**describe(arrangement, certificate, history), **facts}
        record["files"] = sorted(file.name for file in work.iterdir())
        (work / RECORD).write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
        # result.json goes first and comes last: where it is, all the others are of the same run
        forget(folder)
        for file in sorted(work.iterdir(), key=lambda file: file.name == RECORD):
            os.replace(file, folder / file.name)
    except OSError as error:
        if made:
            shutil.rmtree(folder, ignore_errors=True)
        raise InputError(f"{folder}: cannot be written ({error.strerror}); name another folder with --out") from error
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return folder


def forget(folder: Path) -> None:
    """Remove what an earlier run left in a folder, by its own record: the record first, then its files, and the
    folders of its boxes. Other files stay."""
    boxes = folder / BOXES
    if boxes.exists():
        boxes.unlink()
        (folder / BOXES_TABLE).unlink(missing_ok=True)
        for run in boxes_of(folder):
            shutil.rmtree(run)
    if (folder / RECORD).exists():
        try:
            files = recorded(folder).get("files", [])
        except InputError:  # not the kit's, or cut short
            files = []
        (folder / RECORD).unlink()
        for name in files if isinstance(files, list) else []:
            file = folder / Path(str(name)).name
            if file.is_file():
                file.unlink()


def box_folder(number: int | str) -> str:
    """The name of a box's run, among several."""
    return f"box_{number}"


def boxes_of(folder: Path) -> list[Path]:
    """The folders of a run of several boxes, by their numbers."""
    runs = [record.parent for record in folder.glob(f"{box_folder('*')}/{RECORD}")]
    return sorted(runs, key=lambda run: (len(run.name), run.name))


def recorded(scene: Path) -> dict:
    """What result.json says of a run, or of the run beside a scene; an empty certificate where there is none.

    Raises InputError where it cannot be read.
    """
    path = (scene if scene.is_dir() else scene.parent) / RECORD
    if not path.exists():
        return {"certificate": {}}
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(found, dict):
            raise ValueError(f"expected an object in braces, got {type(found).__name__}")
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read ({error}); give the run's scene in a folder of its own") from error
    return found


def _placed_parts(bodies: Sequence[Body], matrices: np.ndarray) -> list[PlacedPart]:
    found = []
    for body, matrix in zip(bodies, matrices, strict=True):
        pose = matrix.copy()  # of what is written about the body's centre, where numbers keep their digits
        pose[:3, 3] += pose[:3, :3] @ body.centre
        solid = body.solid_vertices, body.solid_faces  # closed, as slicers want it
        found.append(PlacedPart(body.name, body.source, body.digest, *solid, pose, matrix))
    return found


def describe(arrangement: Arrangement, certificate: Certificate, history: np.ndarray) -> dict:
    """What result.json says of an arrangement, as plain numbers."""
    bodies, container = arrangement.problem.bodies, arrangement.problem.container
    final = history[-1] if len(history) else np.zeros(len(LOSS_NAMES))
    return {
        "objects": [
            {
                "name": body.name,
                "source": body.source,
                "volume": body.volume,
                "sha256": body.digest,
                "pose": matrix.tolist(),
                "repair": list(body.notes),
            }
            | ({} if body.wishes.turns is None else {"turns": body.wishes.turns.word})
            | ({"fixed": True} if body.wishes.fixed else {})
            for body, matrix in zip(bodies, arrangement.matrices, strict=True)
        ],
        "container": {
            "volume": container.volume,
            "bounds": container.bounds.tolist(),
            "box": None if container.size is None else container.size.tolist(),
            "sha256": container.body.digest,
        },
        "certificate": certificate.to_dict(),
        "losses": {name: float(value) for name, value in zip(LOSS_NAMES, final, strict=True)},
        "gradient_shares": arrangement.gradient_shares,
        "views": [camera.to_dict() for camera in arrangement.cameras],
        "settings": asdict(arrangement.settings),
        "seed": arrangement.settings.seed,
        "iterations": len(history),
        "interrupted": arrangement.interrupted,
        "versions": versions(),
    }


def versions() -> dict[str, str]:
    """Python, the machine's kind, and the packages that results depend on."""
    found = {package: version(package) for package in PACKAGES}
    return {"python": platform.python_version(), "machine": platform.machine(), **found}
