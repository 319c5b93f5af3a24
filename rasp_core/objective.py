"""Eq. 1, `L_total = L_sil + L_is + lambda * L_ext`: the weighted sum that the loop minimises.

The kit adds surface contact to it, a term that the paper does not have; its weight is 0 unless it is asked for.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from . import losses
from .kernels import slices
from .kernels.surface_contact import Neighbours, contact, neighbours
from .problem import SHADOWS, WEIGHTINGS, Settings, slice_resolution
from .query_points import Lattice
from .scene import Scene
from .silhouettes import render
from .util.devices import side_by_side

NEIGHBOUR_REACH = 0.06  # of a mean body's radius: how far the contact term looks around
LOSS_NAMES = ("total", "silhouette", "overlap", "extrusion", "contact")


def objective(scene: Scene, rotation, translation, targets, lattice, settings: Settings, softness_px=None, near=None):
    """Eq. 1 at given poses: losses `(5,)` in the order of LOSS_NAMES, and the images or None. Differentiable.

    With poses of S starts, losses `(S, 5)` and images `(S, K, H, W)`.
    softness_px : the blur of Eq. 2, in pixels of the settings' resolution; that of the first iteration where None.
    near : `find_neighbours` of these poses or of nearby ones, found here where None.

    Terms of weight 0 are not computed and count as 0.
    """
    weights = term_weights(scene, lattice, settings)
    zero = torch.zeros(translation.shape[:-2], device=scene.device, dtype=scene.dtype)
    silhouette = overlap = extrusion = touch = zero
    images = None
    with side_by_side(scene.device, "terms") as aside:
        if weights[0]:
            images = shadows(scene, rotation, translation, settings)
            softness_px = settings.softness(0) if softness_px is None else softness_px
            silhouette = losses.silhouette(images, targets, softness_px * images.shape[-1] / settings.resolution)
        if weights[1]:
            with aside():
                overlap = losses.overlap(scene.stack, scene.half, rotation, translation, lattice, settings.overlap_term)
        if weights[2]:
            movers, corners = scene.movers, scene.moving_vertices
            with aside():
                extrusion = losses.extrusion(
                    scene.container,
                    scene.outlines.vertices[:corners],
                    scene.outlines.vertex_body[:corners],
                    scene.radius[:movers],
                    rotation[..., :movers, :, :],
                    translation[..., :movers, :],
                    settings.epsilon,
                )
        if weights[3]:
            if near is None:
                near = find_neighbours(scene, rotation, translation, settings)
            margin = torch.full_like(scene.radius, settings.contact_margin)
            touch = contact(scene.stack, scene.samples, near, scene.container, rotation, translation, margin)
            touch = touch / lattice.spacing**3
    total = weights[0] * silhouette + weights[1] * overlap + weights[2] * extrusion + weights[3] * touch
    return torch.stack([total, silhouette, overlap, extrusion, touch], -1), images


def shadows(scene: Scene, rotation: Tensor, translation: Tensor, settings: Settings) -> Tensor:
    """What Eq. 2 compares with the targets of `Problem.target_images`: silhouettes, or slices."""
    layers = SHADOWS[settings.shadow]
    if not layers:
        return render(scene.outlines, rotation, translation, scene.views, settings.resolution)
    resolution = slice_resolution(settings.resolution)
    material = scene.material(resolution)
    return slices.render(material, rotation, translation, scene.views, resolution, layers)


def term_weights(scene: Scene, lattice: Lattice, settings: Settings) -> tuple[float, float, float, float]:
    """What silhouettes (as a mean), overlap and extrusion (as sums, in metres) and contact count in Eq. 1.

    Slices count by the area that they show: as many pixels as silhouettes of the same settings have, for each layer.
    """
    weighting = WEIGHTINGS[settings.weighting]
    images = len(scene.cameras) * max(1, SHADOWS[settings.shadow])
    pixels = images * settings.resolution**2 if weighting.silhouette == "sum" else 1
    points = 1 if weighting.overlap == "sum" else lattice.count
    vertices = 1 if weighting.extrusion == "sum" else scene.moving_vertices
    length = lattice.spacing if weighting.unit == "step" else 1.0
    return (
        settings.silhouette_weight * weighting.factors[0] * pixels,
        settings.overlap_weight * weighting.factors[1] / points / length,
        settings.lambda_ * weighting.factors[2] / vertices / length,
        settings.contact_weight / length,
    )


def pulls(losses: Tensor, weights: tuple[float, float, float, float], translation: Tensor) -> Tensor:
    """How hard each term pulls: `(..., 4)`, the norm of its gradient with respect to a translation, in the mean over
    the bodies, times its weight.

    losses `(..., 5)` as `objective` gives them, not yet propagated back; they stay so.
    """
    found = []
    for column, weight in enumerate(weights, start=1):
        loss = losses[..., column].sum()
        slope = torch.autograd.grad(loss, translation, retain_graph=True, allow_unused=True)[0] if weight else None
        norms = translation.new_zeros(translation.shape[:-1]) if slope is None else slope.norm(dim=-1)
        found.append(weight * norms.mean(-1))
    return torch.stack(found, -1)


def find_neighbours(scene: Scene, rotation: Tensor, translation: Tensor, settings: Settings) -> Neighbours:
    """The samples that the contact term looks at, for some iterations about these poses."""
    reach = NEIGHBOUR_REACH * scene.radius.mean().item() + 2 * settings.contact_margin
    place = scene.half, rotation, translation, scene.container
    return neighbours(scene.stack, scene.samples, *place, reach, scene.movers)


def pull_shares(pulled: np.ndarray) -> np.ndarray:
    """Each term's share of the gradient `(4,)`, in the mean over the rows of `pulled` `(J, 4)` in which any term pulls.

    Zeros where there are none.
    """
    pulled = pulled[pulled.sum(1) > 0]
    return (pulled / pulled.sum(1, keepdims=True)).mean(0) if len(pulled) else np.zeros(len(LOSS_NAMES) - 1)
