"""How a recording is written: one JSON object, its numbers quantised to 16 bits, compressed, in base64.

    format      "rasp-recording 1"
    meshes      for each: vertices V, triangles T, metres of one step, metres that it strays from the true surface
    objects     for each: name, number of its mesh, colour "#rrggbb"
    container   number of its mesh, and its centre
    views       for each shadow: image right, image up, direction of looking; centre and width of the viewing volume
    place       x, y, z and r: a position is (x, y, z) + r * q / 8191
    varied      what differs between runs, and its values in order: {"lambda": [0.001, 0.1]}
    losses      their names
    runs        for each: its values in the order of `varied`, the iterations of its F frames, their total
    loading     only where a container is loaded, for each object in its order: its name, what is said of it, the frame
                in which it is in its place: {"names": [...], "words": [...], "stops": [16, 32]}
    data        base64 of a zlib stream

The stream holds P 16 bit integers, first all their low bytes, then all their high bytes; then 32 bit floats, little
endian. The integers: for each mesh V x 3 signed vertices about its middle, in its steps, and T x 3 unsigned corners;
then for each run N x 7 x F signed: x, y, z, and the quaternion w, x, y, z in steps of 1 / 4095, each as its difference
from the frame before, modulo 2^16. An object whose x is -32768 is not there in that frame. The floats: for each run its
losses F x L and its overlap F, a share of the container; NaN where there is none.

Half a step is the error: `step_errors` says what that is. Meshes share `TRIANGLES` triangles; what they stray by is
measured, not bounded.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Sequence

import numpy as np

from ..geometry.cameras import Camera
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..objective import LOSS_NAMES
from ..util import o3d
from . import scene3d

FORMAT = "rasp-recording 1"
TRIANGLES = 6000  # of all meshes together
MOST_OF_ONE = 400
STEPS = 8191  # of a position from the middle to the farthest
TURNS = 4095  # of a quaternion's number from 0 to 1
FINE = 4095  # of a mesh's vertex from its middle to the farthest
ABSENT = -32768


def encode(
    bodies: Sequence[Body],
    container: Container,
    cameras: Sequence[Camera],
    varied: dict[str, list[float]],
    runs: Sequence,
) -> dict:
    """What JSON holds of `recording.Run`s, see above."""
    kinds = {body.digest: body for body in bodies}
    numbers = {digest: number for number, digest in enumerate(kinds)}
    budget = min(MOST_OF_ONE, TRIANGLES // len(kinds))
    meshes = [quantised(*simplified(body, budget)) for body in [*kinds.values(), container.body]]
    there = np.concatenate([run.translation[run.present] for run in runs])
    middle, reach = (there.min(0) + there.max(0)) / 2, max(float(np.ptp(there, axis=0).max()) / 2, 1e-9)
    whole = [part for mesh in meshes for part in (mesh[0].ravel(), mesh[1].astype(np.int16).ravel())]
    whole += [_poses(run, middle, reach).ravel() for run in runs]
    floats = [part.astype("<f4").tobytes() for run in runs for part in (run.losses, run.overlap)]
    planes = np.concatenate(whole).astype("<i2").view(np.uint8).reshape(-1, 2).T.tobytes()
    hues = (255 * scene3d.colours(len(bodies))).round().astype(int)
    return {
        "format": FORMAT,
        "meshes": [[len(v), len(f), step, stray] for v, f, step, stray in meshes],
        "objects": [
            [body.name, numbers[body.digest], "#{:02x}{:02x}{:02x}".format(*hue)]
            for body, hue in zip(bodies, hues, strict=True)
        ],
        "container": [len(kinds), container.body.centre.tolist()],
        "views": [[*camera.axes.round(9).tolist(), list(camera.centre), camera.width] for camera in cameras],
        "place": [*middle.tolist(), reach],
        "varied": varied,
        "losses": list(LOSS_NAMES),
        "runs": [
            {"values": [run.values[name] for name in varied], "iterations": run.iterations.tolist(), "total": run.total}
            for run in runs
        ],
        "data": base64.b64encode(zlib.compress(planes + b"".join(floats), 9)).decode(),
    }


def step_errors(encoded: dict) -> tuple[float, float, float]:
    """Of an encoded recording: metres that a position is off by at most, along an axis; radians that a rotation is; and
    metres that the coarsest mesh strays from the true surface."""
    return encoded["place"][3] / STEPS / 2, 4 / TURNS / 2, max(mesh[3] for mesh in encoded["meshes"])


def simplified(body: Body, triangles: int) -> tuple[np.ndarray, np.ndarray, float]:
    """The body's surface with at most so many triangles: vertices `(V, 3)` about its centre, faces `(F, 3)`, and how
    far the true vertices are from it at most, metres."""
    if len(body.solid_faces) <= triangles:
        return body.solid_vertices, body.solid_faces, 0.0
    geometry, utility = o3d.load().geometry, o3d.load().utility
    surface = geometry.TriangleMesh(
        utility.Vector3dVector(body.solid_vertices), utility.Vector3iVector(body.solid_faces.astype(np.int32))
    )
    coarse = surface.simplify_quadric_decimation(triangles)
    vertices, faces = np.asarray(coarse.vertices), np.asarray(coarse.triangles).astype(np.int64)
    apart = o3d.caster([(vertices, faces)]).compute_distance(body.solid_vertices.astype(np.float32))
    return vertices, faces, float(apart.numpy().max())


def quantised(vertices: np.ndarray, faces: np.ndarray, stray: float) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Vertices as int16, faces, metres of one step, and what the surface strays by with rounding."""
    step = float(np.abs(vertices).max()) / FINE
    return np.round(vertices / step).astype(np.int16), faces, step, stray + step


def quaternions(rotation: np.ndarray) -> np.ndarray:
    """`(F, N, 3, 3)` -> `(F, N, 4)` unit quaternions, scalar first; of the two signs the one near the frame before."""
    from scipy.spatial.transform import Rotation

    found = Rotation.from_matrix(rotation.reshape(-1, 3, 3)).as_quat()[:, [3, 0, 1, 2]].reshape(*rotation.shape[:2], 4)
    turned = np.sign((found[1:] * found[:-1]).sum(-1)) < 0
    signs = np.cumprod(np.concatenate([np.ones_like(found[:1, :, 0]), np.where(turned, -1.0, 1.0)]), 0)
    return found * signs[..., None]


def _poses(run, middle: np.ndarray, reach: float) -> np.ndarray:
    """`(N, 7, F)` int16, differences along the frames."""
    turns = np.where(run.present[..., None, None], run.rotation, np.eye(3))
    places = np.where(run.present[..., None], (run.translation - middle) / reach, 0.0)
    steps = np.concatenate([places * STEPS, quaternions(turns) * TURNS], -1).round().astype(np.int64)
    steps[..., 0] = np.where(run.present, steps[..., 0], ABSENT)
    steps = steps.transpose(1, 2, 0)
    return np.diff(steps, axis=2, prepend=0).astype(np.uint16).view(np.int16)
