"""Fixtures that the tests share: real meshes where there are some, and a cache of the tests' own."""

import os
from pathlib import Path

import pytest
import trimesh

ROOT = Path(__file__).resolve().parent.parent


def real_data() -> Path | None:
    """The folder of the real data: `RASP_DATA_MIRROR`, else `shared/data` beside the checkout, else None."""
    folder = Path(os.environ.get("RASP_DATA_MIRROR") or ROOT.parent / "shared" / "data")
    return folder.resolve() if (folder / "kitchen").is_dir() else None


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory):
    """Nothing that a test caches reaches the user's cache, and no file there helps a test."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RASP_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of the real data; skips where there is none."""
    folder = real_data()
    if folder is None:
        pytest.skip("needs the real meshes: set RASP_DATA_MIRROR to a folder that holds them")
    return folder


@pytest.fixture(scope="session")
def kitchen(data):
    """The 106 Kitchen bodies."""
    from rasp_core.geometry.loading import load_bodies

    return load_bodies([data / "kitchen"])


@pytest.fixture(scope="session")
def problem():
    """Six embedded objects in a box of 30 cm."""
    from data_fetch import kitchen_like
    from rasp_core.geometry import containers
    from rasp_core.problem import Problem

    return Problem(kitchen_like(6), containers.box((0.3, 0.3, 0.3)))


@pytest.fixture(scope="module")
def new_page():
    """A function that opens a page in headless Chromium; the module's last test closes it, with its event loop."""
    import chromium

    with chromium.pages() as new_page:
        yield new_page


@pytest.fixture
def page(new_page):
    page = new_page()
    yield page
    page.close()


@pytest.fixture
def two_balls():
    """Two bodies: balls of radius 1 (finely faceted) about the origin of their frames."""

    from rasp_core.geometry.meshes import make_body

    ball = trimesh.creation.icosphere(subdivisions=4)
    return [make_body(name, ball.vertices, ball.faces) for name in ("ball", "ball#2")]


@pytest.fixture(scope="session")
def crowd():
    """Twelve bodies at random poses in a box: scene, angles `(12, 3)`, translations `(12, 3)`, float64."""
    import torch

    from data_fetch import kitchen_like
    from rasp_core import poses
    from rasp_core.geometry import containers
    from rasp_core.scene import Scene

    box = containers.box((0.3, 0.25, 0.2))
    scene = Scene(kitchen_like(12), box, box.views(), dtype=torch.float64)
    generator = torch.Generator().manual_seed(0)
    turns = poses.rotation_to_angles(
        poses.quaternion_to_rotation(poses.random_quaternions(12, generator, torch.float64))
    )
    return scene, turns, box.random_points(12, generator).double()


@pytest.fixture
def pool(tmp_path):
    """A folder of three blocks, as the command line names it."""
    for i in range(3):
        trimesh.creation.box((0.04 + 0.01 * i, 0.05, 0.06)).export(tmp_path / f"block{i}.stl")
    return [str(tmp_path)]


@pytest.fixture
def cans(tmp_path):
    """A folder of four cans of growing radius."""
    folder = tmp_path / "cans"
    folder.mkdir()
    for i in range(4):
        trimesh.creation.cylinder(0.02 + 0.005 * i, 0.05).export(folder / f"can{i}.stl")
    return folder
