"""Bodies and cameras as the shadow renderer wants them: which edges bound a silhouette, and where they are seen."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache

import numpy as np
import torch
from torch import Tensor

from ..util import capacity
from .cameras import Camera
from .meshes import Body, SolidKey

AREA_KEPT = 0.9  # of a surface that is simplified


class Outlines:
    """The closed surfaces of N bodies, laid out to find contour edges.

    vertices `(V, 3)`, vertex_body `(V,)`; normals `(F, 3)` not normalised, offsets `(F,)` = normal . vertex,
    face_body `(F,)`; edges `(E, 4)` int64: from vertex, to vertex, face on the left, face on the right.
    stray : metres by which surfaces may stray from the bodies', with fewer triangles; 0 for the surfaces themselves.
    """

    def __init__(
        self, bodies: Sequence[Body], device: str | torch.device = "cpu", dtype=torch.float32, stray: float = 0.0
    ):
        bodies = [_simplified(SolidKey(body), stray) for body in bodies] if stray else bodies
        vertices, faces, edges, vertex_body, face_body = [], [], [], [], []
        v_at = f_at = 0
        for i, body in enumerate(bodies):
            vertices.append(body.solid_vertices)
            faces.append(body.solid_faces + v_at)
            edges.append(_edges(SolidKey(body)) + np.array([v_at, v_at, f_at, f_at]))
            vertex_body.append(np.full(len(body.solid_vertices), i))
            face_body.append(np.full(len(body.solid_faces), i))
            v_at += len(body.solid_vertices)
            f_at += len(body.solid_faces)
        points, triangles = np.concatenate(vertices), np.concatenate(faces)
        corners = points[triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        offsets = (normals * corners[:, 0]).sum(1)
        self.count = len(bodies)
        self.vertices = torch.as_tensor(points, device=device, dtype=dtype)
        self.vertex_body = torch.as_tensor(np.concatenate(vertex_body), device=device)
        self.normals = torch.as_tensor(normals, device=device, dtype=dtype)
        self.offsets = torch.as_tensor(offsets, device=device, dtype=dtype)
        self.face_body = torch.as_tensor(np.concatenate(face_body), device=device)
        self.edges = torch.as_tensor(np.concatenate(edges), device=device)

    @cached_property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """The tensors as arrays for the compiled renderer."""
        tensors = (self.vertices, self.vertex_body, self.normals, self.offsets, self.face_body, self.edges)
        return tuple(tensor.numpy() for tensor in tensors)


class Views:
    """K cameras as tensors: axes `(K, 3, 3)` rows right, up, forward; eye `(K, 4)`; centre `(K, 3)`; width `(K,)`."""

    def __init__(self, cameras: Sequence[Camera], device: str | torch.device = "cpu", dtype=torch.float32):
        def tensor(rows):
            return torch.as_tensor(np.array(rows, np.float64), device=device, dtype=dtype)

        self.axes = tensor([camera.axes for camera in cameras])
        self.eye = tensor([camera.eye for camera in cameras])
        self.centre = tensor([camera.centre for camera in cameras])
        self.width = tensor([camera.width for camera in cameras])
        self.perspective = torch.tensor([camera.projection == "perspective" for camera in cameras], device=device)
        self.any_perspective = any(camera.projection == "perspective" for camera in cameras)

    @cached_property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """The tensors as float64 arrays for the compiled renderer."""
        return tuple(x.double().numpy() for x in (self.axes, self.eye, self.centre, self.width))


def project(outlines: Outlines, rotation: Tensor, translation: Tensor, views: Views, resolution: int):
    """Pixel coordinates (u right, v down) of every vertex in every view, `(K, V, 2)`, and depths `(K, V)` or None.

    Depth is the distance before the eye over that of the image plane; None where all views are orthographic.
    """
    body = outlines.vertex_body
    # sums of products, as libraries are slow to multiply many small matrices
    world = (rotation[body] * outlines.vertices[:, None]).sum(-1) + translation[body]
    local = ((world - views.centre[:, None])[:, :, None] * views.axes[:, None]).sum(-1)
    depth = None
    plane = local[..., :2]
    if views.any_perspective:
        distance = eye_distance(views)
        depth = torch.where(views.perspective[:, None], 1 + local[..., 2] / distance[:, None], 1.0)
        plane = plane / depth[..., None]
    scale = resolution / views.width[:, None]
    return torch.stack([plane[..., 0] * scale, -plane[..., 1] * scale], -1) + resolution / 2, depth


def eye_distance(views: Views) -> Tensor:
    """`(K,)` metres from each perspective view's eye to its centre."""
    return (views.centre - views.eye[:, :3]).norm(dim=1)


def contour_edges(outlines: Outlines, rotation: Tensor, translation: Tensor, views: Views):
    """Contour edges over all views: view `(C,)`, edge `(C,)`, sign `(C,)` (+1 where the left face is in front), and
    which of them are real, see `util.capacity`."""
    # the eye in each body's frame, homogeneous: a face looks at it where normal . eye > offset
    place, weight = views.eye[:, None, :3], views.eye[:, None, 3:]
    eye = ((place - weight * translation)[:, :, None, :] @ rotation)[:, :, 0]
    seen = (outlines.normals * eye[:, outlines.face_body]).sum(-1) > weight[..., 0] * outlines.offsets
    left, right = seen[:, outlines.edges[:, 2]], seen[:, outlines.edges[:, 3]]
    place, real = capacity.found((left != right).flatten(), "contour edges")
    view, edge = torch.div(place, left.shape[1], rounding_mode="floor"), place % left.shape[1]
    return view, edge, left[view, edge].to(torch.int32) * 2 - 1, real


@lru_cache(maxsize=1024)
def _simplified(key: SolidKey, stray: float) -> Body:
    """The body simplified; itself where parts thinner than it may stray, which can be large in a shadow, would go."""
    body, rough = key.body, key.body.simplified(stray)
    kept = len(rough.solid_faces) and rough.manifold.surface_area() > AREA_KEPT * body.manifold.surface_area()
    return rough if kept else body


@lru_cache(maxsize=1024)
def _edges(key: SolidKey) -> np.ndarray:
    """`(E, 4)` of a body's solid: from, to, the face that runs along it so, and one that runs against it."""
    faces = key.body.solid_faces
    number = np.arange(len(faces))
    half = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    owner = np.tile(number, 3)
    up = half[:, 0] < half[:, 1]
    forward, backward = half[up], half[~up][:, ::-1]
    a = np.lexsort((forward[:, 1], forward[:, 0]))
    b = np.lexsort((backward[:, 1], backward[:, 0]))
    return np.column_stack([forward[a], owner[up][a], owner[~up][b]])
