"""Slow, naive or foreign versions of what the kit computes, for tests to compare with."""

import string
import subprocess
import tempfile

import numpy as np
import torch
from PIL import Image

from rasp_core import poses


def winding_number(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Generalised winding number of `(M, 3)` points (van Oosterom and Strackee's solid angles): 1 inside, 0 outside."""
    total = np.zeros(len(points))
    for start in range(0, len(faces), 512):
        a, b, c = (vertices[faces[start : start + 512, k]][None] - points[:, None] for k in range(3))
        la, lb, lc = (np.linalg.norm(x, axis=-1) for x in (a, b, c))
        above = (a * np.cross(b, c)).sum(-1)
        below = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
        total += 2 * np.arctan2(above, below).sum(1)
    return total / (4 * np.pi)


def cast_mask(bodies, rotation, translation, camera, resolution: int) -> np.ndarray:
    """Silhouette of placed bodies by one open3d ray through each pixel's centre, `(H, W)` bool."""
    import open3d

    scene = open3d.t.geometry.RaycastingScene()
    for body, turn, shift in zip(bodies, rotation.numpy(), translation.numpy(), strict=True):
        vertices = (body.solid_vertices @ turn.T + shift).astype(np.float32)
        scene.add_triangles(open3d.core.Tensor(vertices), open3d.core.Tensor(body.solid_faces.astype(np.uint32)))
    rays = np.concatenate(camera.rays(resolution), -1).astype(np.float32)
    return np.isfinite(scene.cast_rays(open3d.core.Tensor(rays))["t_hit"].numpy())


def thrown(vertices, faces, lamp, middle, right, up, height: float, size: int) -> np.ndarray:
    """What surfaces, vertices `(V, 3)`, faces `(F, 3)`, darken of a square of a plane, `(size, size)` bool, row 0 on
    top: one open3d ray from the lamp to the middle of each pixel."""
    import open3d

    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(np.asarray(vertices, np.float32), np.asarray(faces, np.uint32))
    found = np.zeros((size, size), bool)
    for row in range(size):
        across = ((np.arange(size) + 0.5) / size - 0.5)[:, None] * np.asarray(right, float)
        points = middle + height * (across + (0.5 - (row + 0.5) / size) * np.asarray(up, float))
        rays = np.concatenate([np.broadcast_to(lamp, points.shape), points - lamp], 1).astype(np.float32)
        found[row] = scene.cast_rays(rays)["t_hit"].numpy() < 1
    return found


def iou(first: np.ndarray, second: np.ndarray) -> float:
    """Intersection over union of two bool arrays."""
    return float((first & second).sum() / (first | second).sum())


def central_differences(function, at: torch.Tensor, step: float) -> torch.Tensor:
    """Gradient of a scalar function by central differences, one entry after the other."""
    gradient = torch.zeros_like(at)
    for index in np.ndindex(*at.shape):
        shift = torch.zeros_like(at)
        shift[index] = step
        gradient[index] = (function(at + shift) - function(at - shift)) / (2 * step)
    return gradient


def total_force(loss, turns, translation):
    """Autograd's gradient of `loss(rotation, translation)` in angles and translations, `(N, 6)`."""
    turns, translation = turns.clone().requires_grad_(), translation.clone().requires_grad_()
    loss(poses.angles_to_rotation(turns), translation).backward()
    return torch.cat([turns.grad, translation.grad], 1)


def numeric_force(loss, turns, translation, step=1e-8):
    """The same by central differences."""
    both = torch.cat([turns, translation], 1)
    return central_differences(lambda b: loss(poses.angles_to_rotation(b[:, :3]), b[:, 3:]), both, step)


def read_letters(images) -> str:
    """What Tesseract reads in silhouettes `(H, W)` bool set beside each other, 64 pixels high on white."""
    used = [image[:, image.any(0)] for image in images]
    line = np.concatenate([np.pad(image, ((0, 0), (image.shape[0] // 12,) * 2)) for image in used], 1)
    picture = Image.fromarray(np.where(line, 0, 255).astype(np.uint8))
    picture = picture.resize((64 * line.shape[1] // line.shape[0], 64), Image.Resampling.LANCZOS)
    with tempfile.NamedTemporaryFile(suffix=".png") as file:
        picture.save(file.name)
        letters = f"tessedit_char_whitelist={string.ascii_uppercase}{string.digits}"
        command = ["tesseract", file.name, "-", "--psm", "8", "-c", letters]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
