"""Surfaces laid out for the renderer."""

import numpy as np
import torch

from data_fetch import cad_like
from rasp_core.geometry.silhouette_edges import Outlines


def test_every_edge_has_a_face_on_each_side_that_runs_along_and_against_it():
    bodies = cad_like(5)
    outlines = Outlines([*bodies, bodies[0]], dtype=torch.float64)
    faces = np.concatenate([b.solid_faces + a for b, a in zip([*bodies, bodies[0]], starts(bodies), strict=True)])
    edges = outlines.edges.numpy()
    assert len(edges) == 1.5 * len(faces)
    for start, end, left, right in edges:
        directed = {left: (start, end), right: (end, start)}
        for face, edge in directed.items():
            corners = faces[face].tolist()
            assert edge in zip(corners, corners[1:] + corners[:1], strict=True)
    assert torch.equal(outlines.vertex_body[outlines.edges[:, 0]], outlines.face_body[outlines.edges[:, 2]])


def starts(bodies):
    return np.cumsum([0, *(len(b.solid_vertices) for b in bodies)])


def test_normals_point_outward():
    outlines = Outlines(cad_like(5), dtype=torch.float64)
    volume = outlines.offsets.sum() / 6
    assert volume > 0
