"""A reader of recordings of its own, after the docstring of `visualize.recording_format`."""

import base64
import struct
import zlib

import numpy as np


def read(encoded: dict) -> tuple[list, list, list]:
    """Vertices and faces of each mesh; x, y, z, w, x, y, z `(F, N, 7)` of each run; its losses and overlap."""
    data = zlib.decompress(base64.b64decode(encoded["data"]))
    count = sum(3 * (v + f) for v, f, _, _ in encoded["meshes"])
    count += sum(7 * len(encoded["objects"]) * len(run["iterations"]) for run in encoded["runs"])
    numbers = [data[k] + 256 * data[count + k] for k in range(count)]
    floats = list(struct.unpack(f"<{(len(data) - 2 * count) // 4}f", data[2 * count :]))

    def signed(value):
        return value - 65536 if value > 32767 else value

    meshes, runs, curves = [], [], []
    for v, f, step, _ in encoded["meshes"]:
        vertices, faces, numbers = numbers[: 3 * v], numbers[3 * v : 3 * (v + f)], numbers[3 * (v + f) :]
        meshes.append((np.reshape([signed(x) * step for x in vertices], (v, 3)), np.reshape(faces, (f, 3))))
    x, y, z, r = encoded["place"]
    for run in encoded["runs"]:
        objects, frames = len(encoded["objects"]), len(run["iterations"])
        poses = np.zeros((frames, objects, 7))
        for n in range(objects):
            for k in range(7):
                value = 0
                for frame in range(frames):
                    value = (value + numbers.pop(0)) % 65536
                    poses[frame, n, k] = signed(value)
        there = poses[..., 0] != -32768
        poses = np.where(there[..., None], poses / ([8191] * 3 + [4095] * 4), np.nan)
        runs.append(poses * [r, r, r, 1, 1, 1, 1] + [x, y, z, 0, 0, 0, 0])
        losses, floats = np.reshape(floats[: frames * 5], (frames, 5)), floats[frames * 5 :]
        curves.append((losses, floats[:frames]))
        floats = floats[frames:]
    assert not numbers
    assert not floats
    return meshes, runs, curves
