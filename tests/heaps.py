"""Heaps of cubes as sculptures, for tests of what is made of them."""

import numpy as np
import torch
import trimesh
from oracles import cast_mask

from rasp_core.art.ceiling import hull_silhouettes
from rasp_core.art.sculpture import Sculpture
from rasp_core.exact.certificate import certify
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.containers import box
from rasp_core.geometry.meshes import make_body, unique_names
from rasp_core.optimizer import Arrangement
from rasp_core.problem import Problem, Settings

SIZE = 128
SIDES = [Camera(0, 0, 1.0), Camera(90, 0, 1.0)]


def heap(places, pictures=None, cameras=SIDES, mesh=None):
    """A sculpture of cubes of edge 0.2, or of a mesh, at places; its pictures `(K, SIZE, SIZE)` bool are what they show
    if they are None."""
    mesh = trimesh.creation.box([0.2] * 3) if mesh is None else mesh
    bodies = unique_names([make_body("cube", mesh.vertices, mesh.faces)] * len(places))
    turns, shifts = torch.eye(3, dtype=torch.float64).repeat(len(places), 1, 1), torch.tensor(np.array(places))
    images = np.stack([cast_mask(bodies, turns, shifts, camera, SIZE) for camera in cameras])
    pictures = images if pictures is None else pictures
    run = Arrangement(
        problem=Problem(bodies, box([1.0] * 3), cameras, pictures.astype(np.float32)),
        settings=Settings(),
        rotation=turns,
        translation=shifts,
        images=images.astype(np.float32),
        targets=pictures.astype(np.float32),
        cameras=cameras,
        history=np.zeros((0, 5)),
    )
    hull = hull_silhouettes(pictures, cameras)
    return Sculpture(run, certify(bodies, run.matrices, run.problem.container), pictures, hull, rounds=[])
