"""Eq. 1, `L_total = L_sil + L_is + lambda * L_ext`: the weighted sum that the loop minimises.

The kit adds surface contact to it, a term that the paper does not have; its weight is 0 unless it is asked for.
"""

from __future__ import annotations

import torch
from torch import Tensor

from . import contact, losses
from .problem import Settings
from .scene import Scene
from .silhouettes import render

NEIGHBOUR_REACH = 0.06  # of a mean body's radius: how far the contact term looks around
LOSS_NAMES = ("total", "silhouette", "overlap", "extrusion", "contact")


def objective(scene: Scene, rotation, translation, targets, lattice, settings: Settings, iteration=0, near=None):
    """Eq. 1 at given poses: losses `(5,)` in the order of LOSS_NAMES, and the images or None. Differentiable.

    With poses of S starts, losses `(S, 5)` and images `(S, K, H, W)`.
    near : `find_neighbours` of these poses or of nearby ones, found here where None.

    Terms of weight 0 are not computed and count as 0.
    """
    zero = torch.zeros(translation.shape[:-2], device=scene.device, dtype=scene.dtype)
    silhouette = overlap = extrusion = touch = zero
    images = None
    if settings.silhouette_weight:
        images = render(scene.outlines, rotation, translation, scene.views, settings.resolution)
        silhouette = losses.silhouette(images, targets, settings.softness(iteration))
    if settings.overlap_weight:
        overlap = losses.overlap(scene.stack, scene.half, rotation, translation, lattice, settings.overlap_term)
    if settings.lambda_:
        movers, corners = scene.movers, scene.moving_vertices
        extrusion = losses.extrusion(
            scene.container,
            scene.outlines.vertices[:corners],
            scene.outlines.vertex_body[:corners],
            scene.radius[:movers],
            rotation[..., :movers, :, :],
            translation[..., :movers, :],
            settings.epsilon,
        )
    if settings.contact_weight:
        if near is None:
            near = find_neighbours(scene, rotation, translation, settings)
        margin = torch.full_like(scene.radius, settings.contact_margin)
        touch = contact.contact(scene.stack, scene.samples, near, scene.container, rotation, translation, margin)
        touch = touch / lattice.spacing**3
    total = (
        settings.silhouette_weight * silhouette
        + settings.overlap_weight * overlap
        + settings.lambda_ * extrusion
        + settings.contact_weight * touch
    )
    return torch.stack([total, silhouette, overlap, extrusion, touch], -1), images


def find_neighbours(scene: Scene, rotation: Tensor, translation: Tensor, settings: Settings) -> contact.Neighbours:
    """The samples that the contact term looks at, for some iterations about these poses."""
    reach = NEIGHBOUR_REACH * scene.radius.mean().item() + 2 * settings.contact_margin
    place = scene.half, rotation, translation, scene.container
    return contact.neighbours(scene.stack, scene.samples, *place, reach, scene.movers)
