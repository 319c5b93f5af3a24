"""Surfaces laid out for the renderer."""

import numpy as np
import pytest
import torch
import trimesh

from data_fetch import cad_like
from rasp_core import poses
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.meshes import make_body
from rasp_core.geometry.silhouette_edges import Outlines, Views, contour_edges, project
from rasp_core.silhouettes import render


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


CAMERAS = [Camera(20, 15, 0.5, (0.02, 0, 0), "perspective"), Camera(110, -40, 0.3)]


@pytest.fixture
def seen():
    """Outlines, poses and views, and each body's vertices in the world."""
    bodies = cad_like(3)
    generator = torch.Generator().manual_seed(0)
    rotation = poses.quaternion_to_rotation(poses.random_quaternions(3, generator, torch.float64))
    translation = 0.05 * torch.randn(3, 3, generator=generator, dtype=torch.float64)
    placed = zip(bodies, rotation.numpy(), translation.numpy(), strict=True)
    world = [body.solid_vertices @ turn.T + shift for body, turn, shift in placed]
    return bodies, Outlines(bodies, dtype=torch.float64), rotation, translation, world


def test_vertices_are_seen_where_the_camera_sees_them(seen):
    _, outlines, rotation, translation, world = seen
    pixels, depth = project(outlines, rotation, translation, Views(CAMERAS, dtype=torch.float64), 64)
    for k, camera in enumerate(CAMERAS):
        row, column = camera.pixels(np.concatenate(world), 64)
        assert np.array_equal(np.floor(pixels[k].numpy()), np.stack([column, row], 1))
    assert (depth[1] == 1).all()
    assert depth[0].min() < 1 < depth[0].max()


def test_contour_edges_part_a_face_that_is_seen_from_one_that_is_not(seen):
    bodies, outlines, rotation, translation, world = seen
    found = contour_edges(outlines, rotation, translation, Views(CAMERAS, dtype=torch.float64))
    sides = []
    for camera in CAMERAS:
        front = []
        for body, vertices in zip(bodies, world, strict=True):
            a, b, c = (vertices[body.solid_faces[:, k]] for k in range(3))
            towards = camera.eye[:3] - a if camera.eye[3] else camera.eye[:3]
            front.append((np.cross(b - a, c - a) * towards).sum(1) > 0)
        sides.append(np.concatenate(front)[outlines.edges[:, 2:].numpy()])
    sides = np.array(sides, int)
    view, edge = np.nonzero(sides[..., 0] != sides[..., 1])
    assert np.array_equal(np.stack([view, edge]), torch.stack(found[:2]).numpy())
    assert np.array_equal(found[2].numpy(), 2 * sides[view, edge, 0] - 1)


def test_outlines_that_may_stray_by_a_twentieth_of_a_pixel_look_the_same():
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.1)
    body = make_body("ball", ball.vertices, ball.faces)
    exact, rough = Outlines([body]), Outlines([body], stray=0.05 * 0.3 / 64)
    assert len(rough.normals) < 0.5 * len(exact.normals)
    turn, place = torch.eye(3)[None], torch.zeros(1, 3)
    images = [render(outlines, turn, place, Views(CAMERAS[1:]), 64) for outlines in (exact, rough)]
    assert (images[0] - images[1]).abs().max() < 0.1
    assert images[1].sum().item() == pytest.approx(images[0].sum().item(), rel=3e-3)


@pytest.mark.parametrize("edges", [(0.1, 0.1, 1e-5), (0.1, 0.05, 2e-4)])
def test_a_foil_thinner_than_outlines_may_stray_keeps_its_shadow(edges):
    foil = trimesh.creation.box(edges)
    body = make_body("foil", foil.vertices, foil.faces)
    turn, place = torch.eye(3)[None], torch.zeros(1, 3)
    above = Views([Camera(0, 90, 0.3)])
    seen = [render(Outlines([body], stray=stray), turn, place, above, 64).sum().item() for stray in (0.0, 5e-4)]
    assert seen[1] == pytest.approx(seen[0], rel=1e-3)
    assert seen[0] == pytest.approx(edges[0] * edges[1] * (64 / 0.3) ** 2, rel=0.02)
