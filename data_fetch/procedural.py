"""Sets of solids that the kit makes itself: no network, no licence, the same for the same seed. Metres, all closed.

They stand for the real pools where those cannot be had; whoever shows a result on them says so.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from manifold3d import CrossSection, FillRule, Manifold, OpType

from rasp_core.geometry.meshes import Body, make_body

SEGMENTS = 32

POLYCUBES = {
    "cube": [(0, 0, 0)],
    "I2": [(0, 0, 0), (1, 0, 0)],
    "I3": [(0, 0, 0), (1, 0, 0), (2, 0, 0)],
    "square": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)],
    "corner": [(0, 0, 0), (1, 0, 0), (0, 1, 0)],
    "L": [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0)],
    "T": [(0, 0, 0), (1, 0, 0), (2, 0, 0), (1, 1, 0)],
    "Z": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (2, 1, 0)],
}


def kitchen_like(count: int = 48, seed: int = 0) -> list[Body]:
    """`count` cans, bottles, bowls, fruit, boxes and mugs of 5 to 14 cm, in turn, each of its own size."""
    return _series(
        count,
        seed,
        [("can", _can), ("bottle", _bottle), ("bowl", _bowl), ("fruit", _fruit), ("box", _box), ("mug", _mug)],
    )


def cad_like(count: int = 48, seed: int = 0) -> list[Body]:
    """`count` plates, angles, nuts, flanges and forks of 4 to 11 cm, cut by exact booleans, in turn."""
    return _series(
        count, seed, [("plate", _plate), ("angle", _angle), ("nut", _nut), ("flange", _flange), ("fork", _fork)]
    )


def polycubes(cell: float = 0.06, gap: float = 0.001) -> list[Body]:
    """The eight polycubes of up to four cells; cells of `cell` metres, less `gap` all round the piece."""
    bodies = []
    for name, cells in POLYCUBES.items():
        cubes = [Manifold.cube((cell, cell, cell)).translate(np.array(c) * cell) for c in cells]
        whole = Manifold.batch_boolean(cubes, OpType.Add)
        bodies.append(solid_body(f"polycube_{name}", _shrunk(whole, cells, cell, gap / 2)))
    return bodies


def torus(ring: float = 0.2, tube: float = 0.1) -> Body:
    """A ring-shaped container about the z axis: the tube's centre line has radius `ring`, the tube `tube` metres."""
    return solid_body("torus", CrossSection.circle(tube, SEGMENTS * 2).translate((ring, 0)).revolve(SEGMENTS * 3))


def duck(length: float = 0.5) -> Body:
    """A duck-shaped container: body, head, beak and tail of ellipsoids, `length` metres long along x, z up."""
    parts = [((0, 0, 0), (1, 0.62, 0.55)), ((0.62, 0, 0.78), (0.44, 0.4, 0.42))]  # body, head
    parts += [((1.08, 0, 0.7), (0.26, 0.2, 0.09)), ((-0.95, 0, 0.22), (0.38, 0.26, 0.2))]  # beak, tail
    ball = Manifold.sphere(1.0, SEGMENTS * 2)
    solid = Manifold.batch_boolean([ball.scale(size).translate(place) for place, size in parts], OpType.Add)
    low, high = np.reshape(solid.bounding_box(), (2, 3))
    return solid_body("duck", solid.translate(-(low + high) / 2).scale((length / (high - low)[0],) * 3))


def head(height: float = 0.4) -> Body:
    """A head-shaped container, `height` metres high along z; its face looks to -y."""
    ball, sides = Manifold.sphere(1.0, SEGMENTS * 2), (-1, 1)
    parts = [((0, 0.12, 0.32), (0.56, 0.7, 0.6)), ((0, -0.1, -0.12), (0.49, 0.58, 0.74))]  # skull, face
    parts += [((0, -0.4, -0.7), (0.22, 0.22, 0.17)), ((0, 0.14, -1.0), (0.36, 0.4, 0.6))]  # chin, neck
    parts += [((0, -0.66, 0.0), (0.075, 0.13, 0.27)), ((0, -0.72, -0.17), (0.13, 0.13, 0.085))]  # nose
    parts += [((0, -0.6, -0.38 - 0.07 * lip), (0.19, 0.1, 0.05)) for lip in (0, 1)]
    parts += [((0.53 * side, 0.08, 0.06), (0.08, 0.15, 0.22)) for side in sides]  # ears
    parts += [((0.21 * side, -0.54, 0.25), (0.17, 0.1, 0.06)) for side in sides]  # brows
    sockets = [ball.scale((0.13, 0.1, 0.08)).translate((0.21 * side, -0.63, 0.13)) for side in sides]
    eyes = [ball.scale((0.1,) * 3).translate((0.21 * side, -0.52, 0.13)) for side in sides]
    whole = Manifold.batch_boolean([ball.scale(size).translate(place) for place, size in parts], OpType.Add)
    solid = (whole - Manifold.batch_boolean(sockets, OpType.Add)) + Manifold.batch_boolean(eyes, OpType.Add)
    solid = solid.trim_by_plane((0, 0, 1), -1.2)
    low, high = np.reshape(solid.bounding_box(), (2, 3))
    return solid_body("head", solid.translate(-(low + high) / 2).scale((height / (high - low)[2],) * 3))


def _series(count: int, seed: int, makers: list[tuple[str, Callable]]) -> list[Body]:
    rng = np.random.default_rng(seed)
    bodies = []
    for i in range(count):
        name, maker = makers[i % len(makers)]
        bodies.append(solid_body(f"{name}_{i // len(makers):02d}", maker(rng)))
    return bodies


def solid_body(name: str, solid: Manifold) -> Body:
    """A manifold's surface as a body."""
    mesh = solid.to_mesh64()
    return make_body(name, np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))


def _shrunk(whole: Manifold, cells: list[tuple[int, int, int]], cell: float, by: float) -> Manifold:
    """The piece less a layer of thickness `by`: the cells about it, grown by that much, taken away."""
    low, high = np.min(cells, 0) - 1, np.max(cells, 0) + 2
    around = [np.add(c, low) for c in np.ndindex(*(high - low)) if tuple(np.add(c, low)) not in set(cells)]
    grown = Manifold.cube((cell + 2 * by,) * 3).translate((-by,) * 3)
    return whole - Manifold.batch_boolean([grown.translate(c * cell) for c in around], OpType.Add)


def _can(rng) -> Manifold:
    return Manifold.cylinder(rng.uniform(0.06, 0.12), rng.uniform(0.025, 0.042), circular_segments=SEGMENTS)


def _bottle(rng) -> Manifold:
    height, radius = rng.uniform(0.1, 0.14), rng.uniform(0.022, 0.032)
    neck, shoulder = radius * rng.uniform(0.35, 0.5), rng.uniform(0.55, 0.7)
    profile = [
        (0, 0),
        (radius, 0),
        (radius, shoulder * height),
        (neck, (shoulder + 0.15) * height),
        (neck, height),
        (0, height),
    ]
    return _revolved(profile)


def _bowl(rng) -> Manifold:
    radius, wall = rng.uniform(0.045, 0.065), rng.uniform(0.006, 0.01)
    depth = radius * rng.uniform(0.5, 0.8)
    ball = Manifold.sphere(1.0, SEGMENTS)
    outer = ball.scale((radius, radius, depth))
    inner = ball.scale((radius - wall, radius - wall, depth - wall))
    return (outer - inner).trim_by_plane((0, 0, -1), 0.0)


def _fruit(rng) -> Manifold:
    """A ball with a few smooth waves."""
    radius, waves = rng.uniform(0.028, 0.045), rng.normal(size=(4, 3))
    stretch, phase = rng.uniform(0.85, 1.25, 3), rng.uniform(0, 6, 4)

    def shape(points):
        bumps = 1 + 0.04 * np.sin(1.5 * points @ waves.T + phase).sum(1)
        return radius * stretch * points * bumps[:, None]

    return Manifold.sphere(1.0, SEGMENTS).warp_batch(shape)


def _box(rng) -> Manifold:
    edges = rng.uniform(0.035, 0.1, 3)
    return Manifold.cube(tuple(edges))


def _mug(rng) -> Manifold:
    radius, height, wall = rng.uniform(0.032, 0.042), rng.uniform(0.07, 0.1), rng.uniform(0.004, 0.006)
    cup = Manifold.cylinder(height, radius, circular_segments=SEGMENTS)
    hollow = Manifold.cylinder(height, radius - wall, circular_segments=SEGMENTS).translate((0, 0, wall))
    ring = CrossSection.circle(wall, 12).translate((0.3 * height, 0)).revolve(SEGMENTS)
    handle = ring.rotate((90, 0, 0)).translate((radius, 0, height / 2))
    return (cup + handle) - hollow


def _plate(rng) -> Manifold:
    width, depth, height = rng.uniform(0.05, 0.1), rng.uniform(0.04, 0.07), rng.uniform(0.008, 0.02)
    radius = rng.uniform(0.004, 0.008)
    holes = [_bore(radius, height, x * width, y * depth) for x in (0.2, 0.8) for y in (0.2, 0.8)]
    return Manifold.cube((width, depth, height)) - Manifold.batch_boolean(holes, OpType.Add)


def _angle(rng) -> Manifold:
    leg, width, wall = rng.uniform(0.04, 0.08), rng.uniform(0.03, 0.06), rng.uniform(0.008, 0.014)
    flat = Manifold.cube((leg, width, wall)) - _bore(0.2 * width, wall, 0.65 * leg, width / 2)
    return flat + Manifold.cube((wall, width, leg * rng.uniform(0.7, 1.0)))


def _nut(rng) -> Manifold:
    radius, height = rng.uniform(0.025, 0.04), rng.uniform(0.02, 0.04)
    return Manifold.cylinder(height, radius, circular_segments=6) - _bore(radius * rng.uniform(0.4, 0.6), height, 0, 0)


def _flange(rng) -> Manifold:
    radius, height = rng.uniform(0.03, 0.05), rng.uniform(0.03, 0.06)
    disc = Manifold.cylinder(0.25 * height, radius, circular_segments=SEGMENTS)
    pipe = Manifold.cylinder(height, 0.55 * radius, circular_segments=SEGMENTS)
    bolts = [
        _bore(0.09 * radius, 0.25 * height, 0.78 * radius * np.cos(a), 0.78 * radius * np.sin(a))
        for a in np.arange(6) * np.pi / 3
    ]
    return disc + pipe - _bore(0.38 * radius, height, 0, 0) - Manifold.batch_boolean(bolts, OpType.Add)


def _fork(rng) -> Manifold:
    width, depth, height = rng.uniform(0.05, 0.08), rng.uniform(0.03, 0.05), rng.uniform(0.05, 0.09)
    slot = Manifold.cube((0.4 * width, 2 * depth, 0.6 * height)).translate((0.3 * width, -0.5 * depth, 0.45 * height))
    pin = Manifold.cylinder(2 * width, 0.12 * height, circular_segments=SEGMENTS).rotate((0, 90, 0))
    return Manifold.cube((width, depth, height)) - slot - pin.translate((-0.5 * width, depth / 2, 0.8 * height))


def _bore(radius: float, height: float, x: float, y: float) -> Manifold:
    """A hole through everything between 0 and `height`."""
    return Manifold.cylinder(3 * height, radius, circular_segments=SEGMENTS).translate((x, y, -height))


def _revolved(profile: list[tuple[float, float]]) -> Manifold:
    return CrossSection([np.array(profile)], FillRule.Positive).revolve(SEGMENTS)
