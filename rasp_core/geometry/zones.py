"""Containers with zones that stay free: what is left of a container without them is a container itself."""

from __future__ import annotations

from collections.abc import Sequence

import manifold3d

from ..util.errors import InputError
from .containers import Container
from .meshes import Body, body_of_solid


def without(container: Container, zones: Sequence[Body], whole: Container | None = None) -> Container:
    """The container without what zones cover, by an exact boolean; its views stay.

    zones : closed bodies where their files have them, in the container's coordinates (a box is about the origin).
    whole : as in `Container`. Raises InputError for a zone that does not meet the container, or if nothing is left.
    """
    base, all_zones = container.base, [*container.zones, *zones]
    hull = base.body.manifold.translate(base.body.centre)
    solids = [zone.manifold.translate(zone.centre) for zone in all_zones]
    for zone, solid in zip(all_zones, solids, strict=True):
        if (hull ^ solid).volume() <= 0:
            low, high = (" x ".join(f"{c:.3g}" for c in corner) for corner in base.bounds)
            raise InputError(
                f"{zone.name}: lies outside the container, which reaches from {low} m to {high} m; move it or leave it "
                "out"
            )
    left = hull - manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    if left.volume() <= 0:
        raise InputError(f"{', '.join(zone.name for zone in all_zones)}: nothing of the container is left beside them")
    shell = body_of_solid(base.body, left, base.body.notes)
    return Container(shell, None, base.directions, whole=whole, base=base, zones=all_zones)
