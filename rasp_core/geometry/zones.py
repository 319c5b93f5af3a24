"""Containers with zones that stay free: what is left of a container without them is a container itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import manifold3d
import numpy as np

from ..util import o3d
from ..util.errors import InputError
from .containers import Container, FreeBox, box
from .meshes import Body, body_of_solid


def without(container: Container, zones: Sequence[Body], whole: Container | None = None) -> Container:
    """The container without what zones cover, by an exact boolean; its views stay.

    zones : closed bodies where their files have them, in the container's coordinates (a box is about the origin).
    whole : as in `Container`. Raises InputError for a zone that does not meet the container, or if nothing is left.
    """
    base, all_zones = container.base, [*container.zones, *zones]
    for zone in all_zones:
        if not _meets(zone, base):
            low, high = (" x ".join(f"{c:.3g}" for c in corner) for corner in base.bounds)
            raise InputError(
                f"{zone.name}: lies outside the container, which reaches from {low} m to {high} m; move it or leave it "
                "out"
            )
    return _cut(container, all_zones, whole)


def _cut(container: Container, all_zones: Sequence[Body], whole: Container | None = None) -> Container:
    """The container without all its zones, which reach into it."""
    base = container.base
    hull = base.body.manifold.translate(base.body.centre)
    solids = [zone.manifold.translate(zone.centre) for zone in all_zones]
    left = hull - manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    if left.volume() <= 0:
        raise InputError(f"{', '.join(zone.name for zone in all_zones)}: nothing of the container is left beside them")
    shell = body_of_solid(base.body, left, base.body.notes)
    return Container(shell, None, base.directions, whole=whole, base=base, zones=all_zones)


def free_without(shape: FreeBox, zones: Sequence[Body]) -> FreeBox:
    """The box to be found without what zones cover.

    zones : closed bodies about the middle of its base, up from its floor. Raises InputError unless the height alone is
    free, and as `without` does for a box as high as the zones.
    """
    if shape.free.tolist() != [False, False, True]:
        raise InputError(
            "zones to keep out have a place in a box whose base is given; name it, as in auto:0.3,0.2,* with the "
            "height free"
        )
    found = replace(shape, zones=(*shape.zones, *zones))
    top = max(float(zone.solid_vertices[:, 2].max() + zone.centre[2]) for zone in found.zones)
    if top <= 0:
        raise InputError(f"{found.zones[0].name}: lies below the box's floor, from which zones are measured up")
    without(box(shape.lengths(top)), _lowered(found.zones, top))
    return found


def box_of(shape: FreeBox, edges: np.ndarray) -> Container:
    """The box to be found with edges `(3,)`, metres, about the origin, without those of its zones that reach into it.

    Raises InputError if nothing is left of it.
    """
    room = box(edges)
    inside = [zone for zone in _lowered(shape.zones, edges[2]) if _meets(zone, room)]
    return _cut(room, inside) if inside else room


def distance_to(zone: Body, points: np.ndarray) -> np.ndarray:
    """Of world points `(..., 3)` to a zone's surface `(...)`, metres, negative inside; exact, however thin it is."""
    scene = o3d.caster([(zone.solid_vertices + zone.centre, zone.solid_faces)])
    return scene.compute_signed_distance(points.astype(np.float32)).numpy()


def _meets(zone: Body, container: Container) -> bool:
    """Whether a zone reaches into a container."""
    hull = container.body.manifold.translate(container.body.centre)
    return (hull ^ zone.manifold.translate(zone.centre)).volume() > 0


def _lowered(zones: Sequence[Body], height: float) -> list[Body]:
    """Zones as they lie in a box of this height about the origin."""
    return [zone.moved(np.array([0, 0, -height / 2])) for zone in zones]
