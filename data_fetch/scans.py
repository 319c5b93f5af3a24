"""Scanned parts of broken things: point sets with normals, closed to solids by Poisson reconstruction."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rasp_core.geometry.meshes import Body, make_body
from rasp_core.util import o3d
from rasp_core.util.errors import InputError

DEPTH = 7  # of the octree: 2^7 cells along the scan's longest edge


def reconstruct(path: str | Path, depth: int = DEPTH) -> Body:
    """A solid, named by the file's stem, from a scan: .npy `(n, 6)` float, points and outward normals of any length.

    Screened Poisson reconstruction (Kazhdan and Hoppe 2013) by open3d. Raises InputError where the file is no such
    array, MeshError where no closed surface comes of it.
    """
    path = Path(path)
    try:
        scan = np.load(path)
    except (OSError, ValueError, EOFError) as error:
        raise InputError(f"{path}: cannot be read as a scan; give an .npy file of points and normals") from error
    if scan.ndim != 2 or scan.shape[1] != 6 or not np.issubdtype(scan.dtype, np.floating):
        raise InputError(f"{path}: a scan is (n, 6) floats, points and normals, got {scan.dtype} {scan.shape}")
    length = np.linalg.norm(scan[:, 3:], axis=1, keepdims=True)
    if not (np.isfinite(scan).all() and (length > 0).all()):
        raise InputError(f"{path}: holds points without a finite place and normal; leave them out")
    o3 = o3d.load()
    cloud = o3.geometry.PointCloud(o3.utility.Vector3dVector(scan[:, :3]))
    cloud.normals = o3.utility.Vector3dVector(scan[:, 3:] / length)
    mesh, _ = o3.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=depth, n_threads=1)
    return make_body(path.stem, np.asarray(mesh.vertices), np.asarray(mesh.triangles))
