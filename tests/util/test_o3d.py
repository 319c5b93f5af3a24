"""open3d comes in silence."""

import subprocess
import sys

import numpy as np
import pytest
import trimesh

from rasp_core.util import o3d


def test_open3d_prints_nothing_in_a_notebooks_kernel():
    """open3d looks for a shell of this name, and starts a server for its visualiser where it finds one."""
    code = "import builtins; builtins.get_ipython = lambda: type('ZMQInteractiveShell', (), {})()\n"
    code += "from rasp_core.util import o3d; assert o3d.load().t.geometry.RaycastingScene"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == ""


def test_open3d_opens_no_channel_to_a_notebooks_page():
    code = "import comm; opened = []; comm.create_comm = make = lambda *a, **k: opened.append((a, k))\n"
    code += "from rasp_core.util import o3d; o3d.load(); print(opened, comm.create_comm is make)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[] True"


def test_a_caster_numbers_surfaces_in_their_order():
    corners, faces = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])
    scene = o3d.caster([(corners + np.array([0, 0, 2]), faces), (corners + np.array([0, 0, 1]), faces)])
    ray = o3d.load().core.Tensor(np.array([[0.2, 0.2, 0, 0, 0, 1]], np.float32))
    hit = scene.cast_rays(ray)
    assert np.allclose(hit["t_hit"].numpy(), 1, atol=1e-6)
    assert hit["geometry_ids"].numpy() == 1


def test_open3d_comes_without_a_web_server_and_leaves_dash_to_others():
    code = "import sys; from rasp_core.util import o3d; o3d.load(); "
    code += "print('dash' in sys.modules, 'flask' in sys.modules); "
    code += "from dash import html; print(html.Div.__name__)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False", "Div"]


def test_depths_reach_the_other_side():
    block = trimesh.creation.box((2, 2, 1))
    points, inwards = (
        np.array([[0.1, 0.2, 0.5], [1, 0.3, 0.1], [0, 0, -2]]),
        np.array([[0, 0, -1], [-1, 0, 0], [0, 0, -1.0]]),
    )
    found = o3d.depths(o3d.caster([(block.vertices, block.faces)]), points, inwards, 0.01)
    assert found == pytest.approx([0.99, 1.99, np.inf], abs=1e-6)
