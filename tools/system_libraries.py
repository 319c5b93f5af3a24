"""Check the shared libraries that the wheels of open3d and vtk load, and install them where that is possible.

Runs before any package is installed, so it uses the standard library alone.
Exit status 0 where all are there; 1 where something is missing and could not be installed.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import sys

# library -> (Debian package, who needs it)
NEEDED = {
    "libusb-1.0.so.0": ("libusb-1.0-0", "open3d"),
    "libGL.so.1": ("libgl1", "open3d and vtk"),
    "libgomp.so.1": ("libgomp1", "open3d"),
    "libX11.so.6": ("libx11-6", "open3d"),
    "libEGL.so.1": ("libegl1", "vtk, to draw without a display"),
    "libEGL_mesa.so.0": ("libegl-mesa0", "vtk, to draw without a GPU"),
}


def missing() -> dict[str, str]:
    """Debian package -> who needs it, for each library that cannot be loaded."""
    absent = {}
    for library, (package, user) in NEEDED.items():
        try:
            ctypes.CDLL(library)
        except OSError:
            absent[package] = user
    return absent


def main() -> int:
    """Check, install as root on Debian and Ubuntu, else print the command."""
    if sys.platform != "linux":
        return 0
    absent = missing()
    if not absent:
        return 0
    install = ["apt-get", "install", "-y", "--no-install-recommends", *sorted(absent)]
    needs = ", ".join(f"{package} ({user})" for package, user in sorted(absent.items()))
    if shutil.which("apt-get") is None:
        print(f"system libraries missing, by their Debian names: {needs}; install them and run again", file=sys.stderr)
        return 1
    if os.geteuid() != 0:
        print(f"system libraries missing: {needs}; run: sudo {' '.join(install)}", file=sys.stderr)
        return 1
    print(f"installing system libraries: {needs}")
    quiet = {"stdout": subprocess.DEVNULL, "env": {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}}
    for command in (["apt-get", "update"], install):
        if subprocess.run(command, **quiet).returncode != 0:
            print(f"could not install system libraries; run: {' '.join(install)}", file=sys.stderr)
            return 1
    return 1 if missing() else 0


if __name__ == "__main__":
    sys.exit(main())
