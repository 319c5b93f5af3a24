"""Painted boxes and balls against their pictures, and the least squares against a dense solution."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from PIL import Image

from rasp_core.art.texturing import SETTINGS, Canvas, paint
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.containers import box
from rasp_core.geometry.meshes import make_body
from rasp_core.util.errors import InputError
from rasp_core.visualize.gltf import read_scene, write_scene

SIZE, EDGE = 50, 10  # a cube of 0.6 leaves a fifth of the picture on each side
CAMERAS = [Camera(0, 0, 1.0), Camera(90, 0, 1.0)]
STILL = np.eye(4)[None]


def cube(edge=0.6):
    mesh = trimesh.creation.box((edge,) * 3)
    return make_body("cube", mesh.vertices, mesh.faces)


def ball():
    mesh = trimesh.creation.icosphere(2, 0.3)
    return make_body("ball", mesh.vertices, mesh.faces)


def pictures(views=2):
    """A gradient and waves, on white."""
    ramp = np.linspace(0, 1, SIZE)
    first = np.stack([np.tile(ramp, (SIZE, 1)), np.tile(ramp[:, None], SIZE), np.full((SIZE, SIZE), 0.5)], -1)
    wave = 0.5 + 0.4 * np.sin(ramp * 30)
    second = np.stack([np.tile(wave[:, None], SIZE), np.tile(wave, (SIZE, 1)), np.full((SIZE, SIZE), 0.3)], -1)
    found = np.ones((2, SIZE, SIZE, 3))
    found[:, EDGE:-EDGE, EDGE:-EDGE] = np.stack([first, second])[:, EDGE:-EDGE, EDGE:-EDGE]
    return found[:views]


def test_faces_of_a_cube_hold_two_pictures():
    painted = Canvas([cube()], STILL, CAMERAS, SIZE).paint(pictures())
    assert painted.seen.mean() == pytest.approx(0.36, abs=0.03)
    assert painted.psnr.min() > 28
    assert painted.ssim.min() > 0.95
    assert np.allclose(painted.images[:, :EDGE], 1)


def test_what_two_views_dispute_is_shared_and_the_naive_way_serves_one():
    plain = np.stack([np.full((SIZE, SIZE, 3), value) for value in (0.2, 0.8)])
    canvas = Canvas([ball()], STILL, CAMERAS, SIZE)
    best, naive = canvas.paint(plain).psnr, canvas.project(plain).psnr
    assert best.min() > naive.min() + 2
    assert naive[1] > 30
    assert abs(best[0] - best[1]) < 1


def test_colours_are_those_of_dense_least_squares():
    canvas = Canvas([cube()], STILL, CAMERAS, 13)
    small = pictures()[:, 1::4, 1::4]
    ties = canvas._ties()
    stacked = np.vstack([canvas.seen_texels.toarray(), np.sqrt(SETTINGS.smoothness) * ties.toarray()])
    wanted = np.vstack([small.reshape(-1, 3)[canvas.pixel], np.zeros((ties.shape[0], 3))])
    dense = np.linalg.lstsq(stacked, wanted, rcond=None)[0]
    seen = np.asarray((canvas.seen_texels != 0).sum(0)).ravel() > 0
    assert np.abs(canvas.paint(small).colours - dense.clip(0, 1))[seen].max() < 0.05


def test_pictures_of_another_size_are_refused():
    canvas = Canvas([cube()], STILL, CAMERAS, SIZE)
    with pytest.raises(InputError, match="a picture for each view is needed"):
        canvas.paint(pictures()[:, ::2])
    with pytest.raises(InputError, match="a picture for each view is needed"):
        canvas.project(pictures(1))


def test_psnr_and_ssim_are_those_of_an_error_that_is_known():
    painted = Canvas([cube()], STILL, CAMERAS, SIZE).paint(pictures())
    off = replace(painted, images=painted.pictures + 0.1)
    assert off.psnr == pytest.approx(20)  # decibels: a mean square error of a hundredth
    assert replace(painted, images=painted.pictures).ssim == pytest.approx(1)
    assert replace(painted, images=1 - painted.pictures).ssim.max() < 0.5


def test_a_sculpture_is_painted_as_its_bodies_are_seen():
    made = SimpleNamespace(bodies=[cube()], matrices=STILL, cameras=CAMERAS, pictures=np.ones((2, SIZE, SIZE), bool))
    painted = paint(made, pictures())
    assert np.array_equal(painted.colours, Canvas([cube()], STILL, CAMERAS, SIZE).paint(pictures()).colours)
    assert paint(made, pictures()[:, ::2, ::2]).images.shape == (2, SIZE // 2, SIZE // 2, 3)
    with pytest.raises(InputError, match="a picture for each view is needed"):
        paint(made, pictures(1))
    with pytest.raises(InputError, match="a picture for each view is needed"):
        paint(made, pictures()[..., 0])


def test_a_painted_scene_is_closed_textured_and_unlit(tmp_path):
    body, matrix = cube(), STILL.copy()
    matrix[0, :3, 3] = [0.01, 0.02, 0.03]
    painted = Canvas([body], matrix, CAMERAS, SIZE).paint(pictures())
    write_scene(tmp_path / "scene.glb", [body], matrix, box((1, 1, 1)), painted)
    (again,), room = read_scene(tmp_path / "scene.glb")
    assert again.volume == pytest.approx(body.volume, rel=1e-5)
    assert again.centre == pytest.approx([0.01, 0.02, 0.03], abs=1e-6)
    assert room.volume == pytest.approx(1.0)
    data = (tmp_path / "scene.glb").read_bytes()
    tree = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    assert all("KHR_materials_unlit" in material["extensions"] for material in tree["materials"])
    scene = trimesh.load_scene(tmp_path / "scene.glb", process=False)
    texture = scene.geometry["cube"].visual.material.baseColorTexture
    assert isinstance(texture, Image.Image)
    assert texture.size == (painted.atlas.size,) * 2
