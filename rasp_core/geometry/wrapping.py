"""A solid of any triangles, open or crossing each other: what their winding number says is inside, on a grid."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from ..util import o3d
from .shells import to_manifold
from .surface_points import surface_points

CELLS = 96  # along the longest edge
BORDER_CELLS = 4
INSIDE = 0.5  # winding number above which a point is inside (Jacobson et al. 2013)
STRAY_CELLS = 2.0  # what of the surface is farther than this from the solid is made a plate of its own
PLATE_CELLS = 1.5  # from its middle to its faces
SAMPLES = 20_000
SIMPLER_CELLS = 0.2  # how far the grid's steps may be smoothed away


def wrap(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, str]:
    """A closed surface around triangles `(V, 3)`, `(F, 3)`, and a line on how far it strays from them.

    Inside is where the generalised winding number is more than a half (fast winding numbers, Barill et al. 2018).
    Sheets that bound nothing become plates a few cells thick. The grid has `CELLS` cells along the longest edge.
    """
    import igl
    from skimage.measure import marching_cubes

    low, high = vertices[faces].reshape(-1, 3).min(0), vertices[faces].reshape(-1, 3).max(0)
    cell = float((high - low).max()) / CELLS
    middle = (low + high) / 2
    counts = np.ceil((high - low) / cell).astype(int) + 2 * BORDER_CELLS
    axes = [(np.arange(n) - (n - 1) / 2) for n in counts]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)  # in cells about the middle
    surface = (vertices - middle) / cell
    caster = o3d.caster([(surface, faces)])
    distance = caster.compute_distance(points.astype(np.float32)).numpy().astype(np.float64)
    winding = igl.fast_winding_number(surface, faces, points)
    if np.sum(winding) < 0:
        winding = -winding
    signed = np.where(winding > INSIDE, -distance, distance)
    samples, _ = surface_points(surface, faces, SAMPLES)
    plates = 0.0
    if (signed < 0).any():
        made = _surface(signed.reshape(counts), axes, marching_cubes)
        bare = cKDTree(made[0]).query(samples)[0] > STRAY_CELLS
        plates = float(bare.mean())
        near_bare = samples[bare]
    else:
        plates, near_bare = 1.0, samples
    if plates > 0.001:
        close = distance < PLATE_CELLS + 2
        by_bare = np.zeros(len(points), bool)
        by_bare[close] = cKDTree(near_bare).query(points[close])[0] < PLATE_CELLS + 3
        signed = np.where(by_bare, np.minimum(signed, distance - PLATE_CELLS), signed)
        made = _surface(signed.reshape(counts), axes, marching_cubes)
    data = to_manifold(*made).simplify(SIMPLER_CELLS).to_mesh64()
    corners = np.asarray(data.vert_properties)[:, :3].astype(np.float64)
    triangles = np.asarray(data.tri_verts, np.int64)
    stray = max(
        float(o3d.caster([(corners, triangles)]).compute_distance(samples.astype(np.float32)).numpy().max()),
        float(caster.compute_distance(corners.astype(np.float32)).numpy().max()),
    )
    sheet = f", {plates:.0%} of it as plates {2 * PLATE_CELLS * cell:.2g} thick" if plates > 0.001 else ""
    words = f"wrapped on a grid of {cell:.2g}{sheet}; it strays {stray * cell:.2g} from the file's surface at most"
    return corners * cell + middle, triangles, words


def _surface(signed: np.ndarray, axes, marching_cubes) -> tuple[np.ndarray, np.ndarray]:
    """Where `signed`, in cells, is 0: vertices `(V, 3)` in cells about the grid's middle, faces `(F, 3)` outward."""
    shifted = np.where(signed == 0, 1e-6, signed)  # a zero on a corner gives faces without area
    vertices, faces, _, _ = marching_cubes(shifted, 0.0)
    mesh = trimesh.Trimesh(vertices + [axis[0] for axis in axes], faces, process=True)
    if mesh.volume < 0:
        mesh.invert()
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)
