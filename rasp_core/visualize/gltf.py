"""Bodies as GLB files: run scenes written and read back, and pages on which they are turned with the mouse."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

from ..art.texturing import Painted
from ..geometry.containers import Container
from ..geometry.meshes import Body, make_body
from ..io import mesh_files
from ..util.errors import InputError, MeshError
from ..util.numbering import numbered
from . import scene3d

Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # as pages look, a view at azimuth 0
LAMP = "scene.add(tracklight)"
LAMPS = f"tracklight.intensity=0.8;{LAMP};scene.add(new THREE.AmbientLight(0xffffff,0.5))"


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
    shell = _coloured(container.body, [0.6, 0.7, 0.8, 0.15])
    pose = _from_centre(container.body, np.eye(4))
    scene.add_geometry(shell, node_name="container", geom_name="container", transform=pose)
    Path(path).write_bytes(scene.export(file_type="glb", tree_postprocessor=_unlit if painted else None))


def read_scene(path: str | Path) -> tuple[list[Body], Container]:
    """Bodies where they lie, and the container, from a GLB of `write_scene` or a run's folder.

    Raises InputError where it cannot be read, has no node `container`, or holds no bodies.
    """
    path = Path(path)
    path = path / "scene.glb" if path.is_dir() else path
    if not path.exists():
        raise InputError(f"{path}: no such scene; name a run's folder or its scene.glb")
    try:
        meshes = {part.name: part for part in mesh_files.load(path).parts}
    except MeshError as error:
        raise InputError(f"{error}; rasp pack writes scenes") from error
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


def encode(bodies: Sequence[Body], matrices: np.ndarray, painted: Painted | None = None) -> bytes:
    """A GLB of the bodies alone with a camera, y up, as pages want it."""
    scene = _scene(bodies, Y_UP @ matrices, painted)
    _ = scene.camera  # made by being asked for; the page looks through it
    return scene.export(file_type="glb", tree_postprocessor=_unlit if painted else None)


def page(bodies: Sequence[Body], matrices: np.ndarray, painted: Painted | None = None, embedded: bool = False) -> str:
    """An HTML page in which the bodies are turned with the mouse; it holds all that it needs (three.js, by trimesh).

    embedded : as a frame for a notebook's cell instead.
    """
    from trimesh.viewer.notebook import scene_to_html, scene_to_notebook

    ready = _Exported(encode(bodies, matrices, painted))
    return _in_soft_light(scene_to_notebook(ready).data if embedded else scene_to_html(ready))


def page_of(data: bytes) -> str:
    """The HTML page, as `page` makes it, of a GLB that is there already."""
    from trimesh.viewer.notebook import scene_to_html

    return _in_soft_light(scene_to_html(_Exported(data)))


def _in_soft_light(page: str) -> str:
    """trimesh's page has one lamp, so bright that faces before it are white and those beside it are black."""
    return page.replace(LAMP, LAMPS)


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
    for body, matrix, colour in zip(bodies, matrices, scene3d.colours(len(bodies)), strict=True):
        stem, _ = numbered(body.name)
        colour = body.wishes.colour or colour
        key = (stem, body.digest, body.wishes.colour)
        if key in geometries:
            scene.graph.update(frame_to=body.name, matrix=_from_centre(body, matrix), geometry=geometries[key])
            continue
        geometries[key] = body.name
        mesh, pose = _coloured(body, [*colour, 1.0]), _from_centre(body, matrix)
        scene.add_geometry(mesh, node_name=body.name, geom_name=body.name, transform=pose)


def _from_centre(body: Body, matrix: np.ndarray) -> np.ndarray:
    """The pose `(4, 4)` of a body's vertices about its centre: a GLB's numbers have 32 bits, its matrices 64."""
    pose = np.array(matrix, np.float64)
    pose[:3, 3] += pose[:3, :3] @ body.centre
    return pose


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


def _coloured(body: Body, rgba: Sequence[float]) -> trimesh.Trimesh:
    """The body's surface about its centre."""
    material = trimesh.visual.material.PBRMaterial(
        baseColorFactor=list(rgba),
        alphaMode="BLEND" if rgba[3] < 1 else "OPAQUE",
        roughnessFactor=0.7,
        metallicFactor=0.0,
    )
    mesh = trimesh.Trimesh(body.vertices - body.centre, body.faces, process=False)
    mesh.visual = trimesh.visual.TextureVisuals(material=material)
    return mesh
