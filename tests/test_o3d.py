"""open3d comes in silence."""

import subprocess
import sys


def test_open3d_prints_nothing_in_a_notebooks_kernel():
    """open3d looks for a shell of this name, and starts a server for its visualiser where it finds one."""
    code = "import builtins; builtins.get_ipython = lambda: type('ZMQInteractiveShell', (), {})()\n"
    code += "from rasp_core import o3d; assert o3d.load().t.geometry.RaycastingScene"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == ""
