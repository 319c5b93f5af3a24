"""What a vessel holds: the inside of a bucket, a pipe, a crate, a sealed shell."""

from __future__ import annotations

import manifold3d
import numpy as np

from .meshes import Body, body_of_solid

LEAST_OF_HULL = 0.01  # volume of a cavity, of the vessel's convex hull
LEAST_WALLED = 0.5  # fraction of a cavity's surface that is the vessel's wall; the rest is open


def cavity(body: Body) -> Body | None:
    """The cavities of a vessel as one solid, None if it has none.

    A cavity is a piece of the convex hull that the vessel does not fill and whose surface is mostly the vessel's wall:
    a bucket's inside up to its rim, a pipe's between its ends, a void. A dent or the hole of a ring is none.
    """
    vessel = body.manifold.translate(body.centre)
    hull = vessel.hull()
    pieces = [
        piece
        for piece in (hull - vessel).decompose()
        if piece.volume() > LEAST_OF_HULL * hull.volume() and _walled(piece, vessel) > LEAST_WALLED
    ]
    if not pieces:
        return None
    inside = manifold3d.Manifold.batch_boolean(pieces, manifold3d.OpType.Add)
    return body_of_solid(body, inside, body.notes)


def _walled(piece: manifold3d.Manifold, vessel: manifold3d.Manifold) -> float:
    """The fraction of a piece's surface that lies on the vessel's."""
    together = (vessel + piece).surface_area()
    return (vessel.surface_area() + piece.surface_area() - together) / 2 / piece.surface_area()


def wall_thickness(body: Body) -> float:
    """Of a wall whose two sides are nearly all of its surface, metres; of another body a length that means little."""
    return float(2 * body.volume / body.manifold.surface_area())


def describe_wall(body: Body) -> str | None:
    """A line on what was perhaps meant by a container that is a wall about a cavity; None if it is no such wall."""
    inside = cavity(body)
    if inside is None or inside.volume < body.volume:
        return None
    millimetres = f"{1000 * wall_thickness(body):.2g} mm"
    litres = f"{1000 * inside.volume:.3g} l"
    extent = " x ".join(f"{edge:.3g}" for edge in np.ptp(inside.vertices, axis=0))
    return f"this is a wall {millimetres} thick; its cavity, {extent} m, holds {litres}: say --cavity"
