"""Slices: shadows that say how much material lies behind each pixel, layer by layer. An extension, not the paper's.

A silhouette saturates: what lies behind other material changes nothing, and n x n cubes of n x n x n fill all three
shadows. A slice is the share of one layer of the viewing volume that is material, as in an X-ray (one layer) or a scan
(several). The material of a body is that of the points inside it; each is shared out linearly over the nearest pixels
and layers, so that slices are differentiable in the poses, and what two bodies share counts twice.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from ..geometry.interior_points import InteriorPoints
from ..geometry.silhouette_edges import Views
from ..util.errors import InputError
from . import dispatch, wrenches


def render(
    material: InteriorPoints, rotation: Tensor, translation: Tensor, views: Views, resolution: int, layers: int
) -> Tensor:
    """Slices `(K * layers, resolution, resolution)`, 1 where a layer is full, view by view, the nearest layer first.

    The layers are as thick as the viewing volume's depth, its width, over their number. rotation `(N, 3, 3)` and
    translation `(N, 3)`, or those of S starts, which give `(S, K * layers, resolution, resolution)`; differentiable in
    both. Raises InputError for perspective views, through which layers are no slices.
    """
    if views.any_perspective:
        raise InputError("slices need orthographic views, got a perspective one; use silhouettes for it")
    draw = _Compiled.apply if dispatch.compiled(rotation.device) else _plain
    count = rotation.shape[-3]
    images = draw(
        rotation.reshape(-1, count, 3, 3), translation.reshape(-1, count, 3), material, views, resolution, layers
    )
    cell = (views.width / resolution) ** 2 * views.width / layers
    images = images.view(*rotation.shape[:-3], len(cell), layers, resolution, resolution) / cell[:, None, None, None]
    return images.flatten(-4, -3)


def _plain(rotation, translation, material, views, n, layers) -> Tensor:
    """Volumes `(S, K, layers, n, n)` in plain torch."""
    body = material.body
    world = (rotation[:, body] @ material.points[:, :, None])[..., 0] + translation[:, body]
    local = torch.einsum("kij,skpj->skpi", views.axes, world[:, None] - views.centre[:, None])
    scale = (n / views.width)[:, None]
    u, v = local[..., 0] * scale + n / 2 - 0.5, n / 2 - 0.5 - local[..., 1] * scale
    w = local[..., 2] * (layers / views.width)[:, None] + layers / 2 - 0.5 if layers > 1 else torch.zeros_like(u)
    corner = [each.detach().floor() for each in (w, v, u)]
    beyond = [each - low for each, low in zip((w, v, u), corner, strict=True)]
    starts = torch.arange(u.shape[0] * u.shape[1], device=u.device).view(*u.shape[:2], 1)
    images = torch.zeros(u.shape[0] * u.shape[1] * layers * n * n, dtype=u.dtype, device=u.device)
    for number in range(8):
        step = number >> 2 & 1, number >> 1 & 1, number & 1
        at = [low.long() + one for low, one in zip(corner, step, strict=True)]
        share = material.volume.expand_as(u)
        for part, one in zip(beyond, step, strict=True):
            share = share * (part if one else 1 - part)
        kept = torch.ones_like(u, dtype=torch.bool)
        for index, size in zip(at, (layers, n, n), strict=True):
            kept &= (index >= 0) & (index < size)
        place = ((starts * layers + at[0]) * n + at[1]) * n + at[2]
        images = images.index_add(0, place[kept], share[kept])
    return images.view(*u.shape[:2], layers, n, n)


class _Compiled(torch.autograd.Function):
    """`_plain` by compiled loops, for tensors on the CPU."""

    @staticmethod
    def forward(ctx, rotation, translation, material, views, n, layers):
        from .splat import splat

        place = wrenches.arrays(rotation, translation)
        axes, _, centres, widths = views.arrays
        first = torch.searchsorted(material.body, torch.arange(rotation.shape[1] + 1)).numpy()
        volume = material.volume[torch.from_numpy(first[:-1])].double().numpy()
        ctx.scene = material.points.numpy(), first, volume, *place, axes, centres, widths
        images = np.zeros((len(rotation) * len(widths), layers, n, n), material.points.numpy().dtype)
        dispatch.in_parallel(splat, *ctx.scene, images)
        return torch.from_numpy(images).view(len(rotation), len(widths), layers, n, n)

    @staticmethod
    def backward(ctx, upstream):
        from .splat import pull

        starts, bodies = ctx.scene[3].shape[:2]
        wrench = np.zeros((starts * upstream.shape[1], bodies, 4, 3))
        dispatch.in_parallel(pull, upstream.flatten(0, 1).contiguous().numpy(), *ctx.scene, wrench)
        total = torch.from_numpy(wrench.reshape(starts, -1, bodies, 4, 3).sum(1)).to(upstream.dtype)
        return *wrenches.gradients(total), None, None, None, None
