"""Profiles against silhouettes drawn of the turned body itself."""

import numpy as np
import torch
import trimesh

from data_fetch import kitchen_like
from rasp_core.art.run_length import ROWS, Profiles, _masks, _runs
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.silhouette_edges import Outlines, Views
from rasp_core.silhouettes import mask

CAMERAS = [Camera(0, 0, 1.0), Camera(75, 20, 1.0)]


def drawn(runs):
    image = np.zeros((ROWS, ROWS), bool)
    for row, spans in enumerate(runs):
        for first, last in spans:
            image[row, first:last] = True
    return image


def test_runs_are_the_silhouettes_of_the_turned_body():
    bodies = kitchen_like(3)
    profiles = Profiles.of(bodies, CAMERAS, turns=4, seed=1)
    assert profiles.runs.shape[:2] == (12, 2)
    for index in (0, 5, 11):
        body = bodies[index // 4]
        views = Views([Camera(c.azimuth_deg, c.elevation_deg, 2 * body.radius) for c in CAMERAS])
        turn = torch.from_numpy(profiles.rotation[index])[None].float()
        images = mask(Outlines([body]), turn, torch.zeros(1, 3), views, ROWS).numpy()
        for k, image in enumerate(images):
            assert (drawn(profiles.runs[index, k]) != image).mean() < 0.002
        corners = body.solid_vertices @ profiles.rotation[index].T
        assert np.allclose(profiles.half_extents[index], np.abs(corners).max(0))


def test_holes_keep_their_runs():
    ring = trimesh.creation.annulus(0.5, 1.0, 0.2)
    body = make_body("ring", ring.vertices, ring.faces)
    runs = _runs(_masks(body, np.eye(3)[None], [Camera(0, 90, 1.0)]))[0, 0]
    assert ((runs[ROWS // 2, :2, 1] - runs[ROWS // 2, :2, 0]) > 0).all(), "two runs across the hole"
    assert (runs[ROWS // 2, 2:] == 0).all()
