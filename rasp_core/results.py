"""Save a run's folder and read scenes back.

scene.glb : one node for each body, named as the body, and one node `container`; metres, world z up.
result.json : poses, volumes, density both ways, certificate, last losses, views, settings, seed, versions, device.
history.csv : every loss at every iteration. silhouettes.png : target, rendered, difference for each view.
"""

from __future__ import annotations

import csv
import json
import os
import platform
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

from . import show, untrusted
from .arrange import LOSS_NAMES, Arrangement
from .certify import Certificate
from .containers import Container
from .errors import InputError, MeshError
from .meshes import Body, make_body
from .painting import Painted

Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # as pages look, a view at azimuth 0
RECORD, PART = "result.json", ".part-"
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
) -> Path:
    """Write a run's folder; each file appears whole or not at all.

    facts : further entries of result.json. history : `(I, 5)` losses, the arrangement's own where None.
    scenes : further scenes' file names, and the poses `(N, 4, 4)` that the bodies have in them. images : further
    pictures' file names, and pixels uint8. painted : the bodies' colours in scene.glb.
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
        record = {**describe(arrangement, certificate, history), **facts}
        (work / RECORD).write_text(json.dumps(record, indent=1) + "\n")
        with (work / "history.csv").open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["iteration", *LOSS_NAMES])
            writer.writerows([i, *map(float, row)] for i, row in enumerate(history))
        for name, pixels in (images or {}).items():
            Image.fromarray(pixels).save(work / name)
        figure = show.silhouette_figure(arrangement.targets, arrangement.images, arrangement.cameras)
        figure.savefig(work / "silhouettes.png", dpi=100)
        # result.json goes first and comes last: where it is, all the others are of the same run
        (folder / RECORD).unlink(missing_ok=True)
        for file in sorted(work.iterdir(), key=lambda file: file.name == RECORD):
            os.replace(file, folder / file.name)
    except OSError as error:
        if made:
            shutil.rmtree(folder, ignore_errors=True)
        raise InputError(f"{folder}: cannot be written ({error.strerror}); name another folder with --out") from error
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return folder


def describe(arrangement: Arrangement, certificate: Certificate, history: np.ndarray) -> dict:
    """What result.json says of an arrangement, as plain numbers."""
    bodies, container = arrangement.problem.bodies, arrangement.problem.container
    final = history[-1] if len(history) else np.zeros(len(LOSS_NAMES))
    return {
        "objects": [
            {"name": body.name, "volume": body.volume, "sha256": body.digest, "pose": matrix.tolist()}
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


def write_scene(
    path: str | Path,
    bodies: Sequence[Body],
    matrices: np.ndarray,
    container: Container,
    painted: Painted | None = None,
) -> None:
    """Write bodies placed by `matrices` `(N, 4, 4)` and the container as a GLB.

    Copies of one body share one geometry, but where the bodies are painted: then they share one unlit texture.
    """
    scene = _scene(bodies, matrices, painted)
    shell = _coloured(container.body.vertices, container.body.faces, [0.6, 0.7, 0.8, 0.15])
    scene.add_geometry(shell, node_name="container", geom_name="container")
    Path(path).write_bytes(scene.export(file_type="glb", tree_postprocessor=_unlit if painted else None))


def page(bodies: Sequence[Body], matrices: np.ndarray, painted: Painted | None = None, embedded: bool = False) -> str:
    """An HTML page in which the bodies are turned with the mouse; it holds all that it needs (three.js, by trimesh).

    embedded : as a frame for a notebook's cell instead.
    """
    from trimesh.viewer.notebook import scene_to_html, scene_to_notebook

    ready = _Exported(glb(bodies, matrices, painted))
    return scene_to_notebook(ready).data if embedded else scene_to_html(ready)


def glb(bodies: Sequence[Body], matrices: np.ndarray, painted: Painted | None = None) -> bytes:
    """A GLB of the bodies alone with a camera, y up, as pages want it."""
    scene = _scene(bodies, Y_UP @ matrices, painted)
    _ = scene.camera  # made by being asked for; the page looks through it
    return scene.export(file_type="glb", tree_postprocessor=_unlit if painted else None)


def page_of(data: bytes) -> str:
    """The HTML page, as `page` makes it, of a GLB that is there already."""
    from trimesh.viewer.notebook import scene_to_html

    return scene_to_html(_Exported(data))


class _Exported:
    """What trimesh's viewer asks of a scene, where the GLB is there already."""

    camera = None

    def __init__(self, data: bytes):
        self.data = data

    def export(self, file_type: str) -> bytes:
        return self.data


def _scene(bodies: Sequence[Body], matrices: np.ndarray, painted: Painted | None) -> trimesh.Scene:
    scene = trimesh.Scene()
    if painted is None:
        _add_plain(scene, bodies, matrices)
    else:
        _add_painted(scene, bodies, matrices, painted)
    return scene


def _add_plain(scene: trimesh.Scene, bodies: Sequence[Body], matrices: np.ndarray) -> None:
    geometries: dict[tuple, str] = {}
    for body, matrix, colour in zip(bodies, matrices, show.colours(len(bodies)), strict=True):
        stem = body.name.split("#")[0]
        key = (stem, body.digest)
        if key in geometries:
            scene.graph.update(frame_to=body.name, matrix=matrix, geometry=geometries[key])
            continue
        geometries[key] = body.name
        mesh = _coloured(body.vertices, body.faces, [*colour, 1.0])
        scene.add_geometry(mesh, node_name=body.name, geom_name=body.name, transform=matrix)


def _add_painted(scene: trimesh.Scene, bodies: Sequence[Body], matrices: np.ndarray, painted: Painted) -> None:
    image = Image.fromarray(painted.atlas.texture(painted.colours))
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=image, metallicFactor=0.0, roughnessFactor=1.0)
    for k, (body, matrix) in enumerate(zip(bodies, matrices, strict=True)):
        own = slice(painted.first[k], painted.first[k + 1])
        vertices = painted.corners[own].reshape(-1, 3)
        mesh = trimesh.Trimesh(vertices, np.arange(len(vertices)).reshape(-1, 3), process=False)
        mesh.visual = trimesh.visual.TextureVisuals(painted.atlas.uv[own].reshape(-1, 2), material=material)
        scene.add_geometry(mesh, node_name=body.name, geom_name=body.name, transform=matrix)


def _unlit(tree: dict) -> None:
    """Have a GLB's colours shown as they are, without light, and textures without coarser copies of themselves."""
    for material in tree["materials"]:
        material["extensions"] = {"KHR_materials_unlit": {}}
    tree["extensionsUsed"] = ["KHR_materials_unlit"]
    tree["samplers"] = [{"magFilter": 9729, "minFilter": 9729}]
    for texture in tree["textures"]:
        texture["sampler"] = 0


def read_scene(path: str | Path) -> tuple[list[Body], Container]:
    """Bodies where they lie, and the container, from a GLB of `write_scene` or a run's folder.

    Raises InputError where it cannot be read, has no node `container`, or holds no bodies.
    """
    path = Path(path)
    path = path / "scene.glb" if path.is_dir() else path
    if not path.exists():
        raise InputError(f"{path}: no such scene; name a run's folder or its scene.glb")
    try:
        scene, meshes = untrusted.load(path), {}
    except MeshError as error:
        raise InputError(f"{error}; rasp pack writes scenes") from error
    for node in scene.graph.nodes_geometry:
        transform, geometry = scene.graph[node]
        meshes[node] = scene.geometry[geometry].copy().apply_transform(transform)
    if "container" not in meshes:
        raise InputError(f"{path}: has no node named container; write it with rasp pack")
    shell = meshes.pop("container")
    if not meshes:
        raise InputError(f"{path}: holds no objects beside the container")
    try:
        bodies = [make_body(name, mesh.vertices, mesh.faces) for name, mesh in sorted(meshes.items())]
        body = make_body("container", shell.vertices, shell.faces)
    except MeshError as error:
        raise InputError(f"{path}: {error}") from error
    return bodies, Container(body)


def _coloured(vertices: np.ndarray, faces: np.ndarray, rgba: Sequence[float]) -> trimesh.Trimesh:
    material = trimesh.visual.material.PBRMaterial(
        baseColorFactor=list(rgba),
        alphaMode="BLEND" if rgba[3] < 1 else "OPAQUE",
        roughnessFactor=0.7,
        metallicFactor=0.0,
    )
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.visual = trimesh.visual.TextureVisuals(material=material)
    return mesh
