"""Pictures are drawn, without a display, and show what they should."""

import subprocess
import sys

import numpy as np
from matplotlib.colors import rgb_to_hsv
from PIL import Image

from data_fetch import kitchen_like, torus
from rasp_core.art.texturing import Canvas
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.containers import Container, box
from rasp_core.visualize import scene3d


def placed(count):
    bodies = kitchen_like(count)
    matrices = np.tile(np.eye(4), (count, 1, 1))
    matrices[:, :3, 3] = [[0.15 * (i - 1) - body.centre[0], 0, 0] for i, body in enumerate(bodies)]
    return bodies, matrices


def test_shadows_fall_on_walls_behind():
    bodies, room = kitchen_like(1), box((0.2, 0.2, 0.2))
    view, image = room.views()[0], np.zeros((32, 32))
    pictures = []
    for dark in (0.0, 1.0):
        image[:16] = dark  # the upper half of the wall
        pictures.append(scene3d.scene_picture(bodies, np.eye(4)[None], room, (200, 200), shadows=[(view, image)]))
    light, shaded = (picture[..., 0].astype(int) for picture in pictures)
    changed = np.argwhere(shaded < light - 50)
    assert len(changed) > 500
    unchanged_wall = np.argwhere((light > 225) & (light < 245) & (shaded == light))
    assert changed[:, 0].mean() < unchanged_wall[:, 0].mean(), "row 0 of the silhouette is on top"


def test_bodies_take_the_colours_given():
    bodies, room = kitchen_like(1), box((0.2, 0.2, 0.2))
    red, green = (
        scene3d.scene_picture(bodies, np.eye(4)[None], room, (200, 200), hues=np.array([hue]))
        for hue in ([1.0, 0, 0], [0, 1.0, 0])
    )
    assert red[..., 0].astype(int).sum() > red[..., 1].astype(int).sum()
    assert green[..., 1].astype(int).sum() > green[..., 0].astype(int).sum()
    faint = scene3d.scene_picture(bodies, np.eye(4)[None], room, (200, 200), hues=np.array([[1.0, 0, 0, 0.1]]))
    assert faint[..., 1].mean() > red[..., 1].mean(), "white shines through"


def test_a_scene_is_drawn_in_its_bodies_colours():
    bodies, matrices = placed(3)
    picture = scene3d.scene_picture(bodies, matrices, box((0.45, 0.15, 0.15)), (300, 200))
    assert picture.shape == (200, 300, 3)
    assert (picture == 255).all(-1).mean() > 0.4, "white ground"
    saturated = np.ptp(picture.astype(int), axis=-1) > 60
    assert saturated.mean() > 0.01


def test_the_bodies_alone_and_a_mesh_container_are_drawn_too():
    bodies, matrices = placed(2)
    for container in (None, Container(torus())):
        assert scene3d.scene_picture(bodies, matrices, container, (200, 200)).std() > 5


def test_colours_of_neighbours_differ():
    colours = scene3d.colours(50)
    assert colours.min() >= 0
    assert colours.max() <= 1
    assert np.linalg.norm(np.diff(colours, axis=0), axis=1).min() > 0.2
    assert scene3d.colours(0).shape == (0, 3)


def test_hues_are_a_golden_ratio_apart():
    hues = rgb_to_hsv(scene3d.colours(20))[:, 0]
    assert np.allclose(np.diff(hues) % 1, (np.sqrt(5) - 1) / 2)


def test_colours_need_no_matplotlib():
    code = "import sys; sys.modules['matplotlib'] = None; from rasp_core.visualize import scene3d; scene3d.colours(3)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_stage_draws_other_poses_as_a_new_one_would():
    bodies, matrices = placed(3)
    room = box((0.45, 0.15, 0.15))
    moved = matrices.copy()
    moved[:, 2, 3] += 0.05
    stage = scene3d.Stage(bodies, matrices, room, (200, 200))
    before, after, again = (stage.picture(where) for where in (matrices, moved, matrices))
    stage.close()
    assert np.array_equal(before, again)
    assert np.abs(after.astype(int) - scene3d.scene_picture(bodies, moved, room, (200, 200))).mean() < 0.5
    assert np.abs(after.astype(int) - before).mean() > 2


def test_exploded_keeps_turns_and_stretches_distances():
    bodies, matrices = placed(3)
    apart = scene3d.exploded(bodies, matrices, share=0.5)
    assert np.array_equal(apart[:, :3, :3], matrices[:, :3, :3])
    before, after = (
        [pose[:3, 3] + body.centre for body, pose in zip(bodies, where, strict=True)] for where in (matrices, apart)
    )
    assert np.allclose(np.diff(after, axis=0), 1.5 * np.diff(before, axis=0))
    assert np.allclose(np.mean(after, axis=0), np.mean(before, axis=0))


def test_trimmed_cuts_white_away():
    picture = np.full((40, 60, 3), 255, np.uint8)
    assert scene3d.trimmed(picture).shape == picture.shape
    picture[10:20, 30:35, 1] = 0
    assert scene3d.trimmed(picture, 0).shape == (10, 5, 3)
    assert scene3d.trimmed(picture, 100).shape == picture.shape


def test_a_turntable_comes_round_and_is_a_film(tmp_path):
    bodies, matrices = placed(3)
    stage = scene3d.Stage(bodies, matrices, size=(80, 80), azimuth_deg=0.0, elevation_deg=12.0)
    first = stage.picture(matrices)
    film = stage.turntable(matrices, frames=4)
    stage.close()
    assert np.array_equal(film[0], first)
    assert np.abs(film[1].astype(int) - first).mean() > 2
    scene3d.save_gif(tmp_path / "film.gif", film, seconds=2.0)
    with Image.open(tmp_path / "film.gif") as read:
        assert (read.n_frames, read.info["duration"], read.info["loop"]) == (4, 500, 0)


def test_paint_is_shown_unlit_and_in_parallel_as_an_orthographic_view_sees_it():
    bodies, matrices = placed(3)
    camera = Camera(0, 0, 0.6)
    plain = np.ones((1, 64, 64, 3)) * [0.2, 0.6, 0.4]
    painted = Canvas(bodies, matrices, [camera], 64).paint(plain)
    look = {"size": (128, 128), "azimuth_deg": 0.0, "elevation_deg": 0.0, "painted": painted}
    picture = scene3d.scene_picture(bodies, matrices, parallel=True, **look)
    inside = picture[(picture < 250).any(2)]
    assert np.abs(np.median(inside, axis=0) / 255 - [0.2, 0.6, 0.4]).max() < 0.02
    apart = scene3d.trimmed(picture, 0).shape[1] / scene3d.trimmed(picture, 0).shape[0]
    rows, columns = np.nonzero(painted.seen[0])
    assert abs(apart - (np.ptp(columns) + 1) / (np.ptp(rows) + 1)) < 0.25


def test_a_lamp_stands_before_each_shadow():
    bodies, matrices = placed(1)
    view = Camera(0, 0, 0.3)
    look = {"size": (200, 200), "shadows": [(view, np.zeros((8, 8)))]}
    dark, lit = (scene3d.scene_picture(bodies, matrices, lamps=lamps, **look).astype(int) for lamps in (False, True))
    yellow = [((p[..., 0] > 230) & (p[..., 1] > 180) & (p[..., 2] < 120)).sum() for p in (dark, lit)]
    assert yellow[1] > yellow[0] + 10


def test_triton_is_loaded_before_mesa():
    """The other way round their two LLVMs crash the process, with torch's wheels for CUDA and Debian's Mesa."""
    code = (
        "import sys; from rasp_core.visualize import scene3d; scene3d._load_pyvista(); names = list(sys.modules); "
        "print(names.index('torch._dynamo') < min(names.index(name) for name in names if name.startswith('vtk')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True"
