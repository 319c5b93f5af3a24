"""open3d comes in silence."""

import subprocess
import sys

import numpy as np

from rasp_core.util import o3d


def test_open3d_prints_nothing_in_a_notebooks_kernel():
    """open3d looks for a shell of this name, and starts a server for its visualiser where it finds one."""
    code = "import builtins; builtins.get_ipython = lambda: type('ZMQInteractiveShell', (), {})()\n"
    code += "from rasp_core.util import o3d; assert o3d.load().t.geometry.RaycastingScene"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == ""


def test_a_caster_numbers_surfaces_in_their_order():
    corners, faces = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])
    scene = o3d.caster([(corners + np.array([0, 0, 2]), faces), (corners + np.array([0, 0, 1]), faces)])
    ray = o3d.load().core.Tensor(np.array([[0.2, 0.2, 0, 0, 0, 1]], np.float32))
    hit = scene.cast_rays(ray)
    assert np.allclose(hit["t_hit"].numpy(), 1, atol=1e-6)
    assert hit["geometry_ids"].numpy() == 1
