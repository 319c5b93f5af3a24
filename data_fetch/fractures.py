"""Vessels, and broken things: closed bodies parted by rough random surfaces, exactly, so that no material is lost."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh
from manifold3d import CrossSection, Manifold
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation

from rasp_core.geometry.meshes import Body, make_body
from rasp_core.util.errors import InputError

from .procedural import solid_body

SEGMENTS = 64
ROUGHNESS = 0.025  # of the piece's diagonal: how far the surface of a cut strays from a plane
# how far it strays, and by which power of their length its waves are higher the longer they are
CUTS = {"flat": (0.0, 0.7), "wavy": (ROUGHNESS, 0.7), "rough": (ROUGHNESS, 0.25)}
WAVES = 24  # of which its height is made
CELLS = 40  # along an edge of the surface
SMALLEST = 0.25  # of an even share: the least volume of a part
TRIES = 200  # planes tried for each cut


def vessels(seed: int = 0) -> list[Body]:
    """Ten closed vessels of 9 to 20 cm: mugs, bowls, vases and gravy boats, each of its own proportions."""
    rng = np.random.default_rng([7, seed])
    kinds = [("mug", _mug), ("bowl", _bowl), ("vase", _vase), ("gravy_boat", _gravy_boat)]
    return [solid_body(f"{kinds[i % 4][0]}_{i // 4}", kinds[i % 4][1](rng)) for i in range(10)]


def fracture(body: Body, parts: int, seed: int = 0, *, cut: str = "wavy", lost: float = 0.0) -> list[Body]:
    """The body broken into `parts` connected pieces, where they lie in the whole, the largest first.

    Each cut parts the largest piece by a random plane with random waves: "flat" has none, "rough" higher short ones.
    lost : metres that each side of a cut has lost to wear. Raises InputError for fewer than two parts, for another cut,
    or where no cut into connected pieces is found.
    """
    if parts < 2:
        raise InputError(f"a broken thing has at least two parts, got {parts}")
    if cut not in CUTS:
        raise InputError(f"cut {cut!r} is unknown; use one of {', '.join(CUTS)}")
    rng = np.random.default_rng([11, seed])
    pieces, share = [body.manifold.translate(body.centre)], SMALLEST * body.volume / parts
    while len(pieces) < parts:
        pieces.sort(key=lambda piece: -piece.volume())
        for k, piece in enumerate(pieces):
            halves = _broken(piece, share, rng, cut, lost)
            if halves is not None:
                pieces[k : k + 1] = halves
                break
        else:
            raise InputError(f"{body.name}: no cut into connected pieces was found; use fewer parts or another seed")
    pieces.sort(key=lambda piece: -piece.volume())
    return [solid_body(f"{body.name}_part{i + 1:02d}", piece) for i, piece in enumerate(pieces)]


def joined(parts: Sequence[Body]) -> Body:
    """The whole that parts make where they lie; where they touch they are united."""
    first = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
    faces = np.concatenate([part.faces + k for part, k in zip(parts, first, strict=True)])
    return make_body("whole", np.concatenate([part.vertices for part in parts]), faces)


def scatter(parts: Sequence[Body], seed: int = 0) -> tuple[list[Body], np.ndarray]:
    """The parts turned and moved at random, and the `(N, 4, 4)` motions that bring them back."""
    rng, found, back = np.random.default_rng(seed), [], []
    for part in parts:
        motion = trimesh.transformations.random_rotation_matrix(rng.random(3))
        motion[:3, 3] = rng.normal(size=3)
        found.append(make_body(part.name, part.placed(motion), part.solid_faces))
        back.append(np.linalg.inv(motion))
    return found, np.stack(back)


def _broken(piece: Manifold, share: float, rng: np.random.Generator, cut: str, lost: float) -> list[Manifold] | None:
    """Two connected pieces, neither smaller than `share` cubic metres."""
    box = np.array(piece.bounding_box()).reshape(2, 3)
    middle, size = box.mean(0), float(np.linalg.norm(np.ptp(box, axis=0)))
    for _ in range(TRIES):
        point = middle + rng.normal(size=3) * 0.12 * np.ptp(box, axis=0)
        block, upwards = _rough_half_space(rng, size, cut)
        if lost:
            below, above = (block.translate(point + way * lost * upwards) for way in (-1, 1))
            halves = piece ^ below, piece - above
        else:
            halves = piece.split(block.translate(point))
        if all(half.volume() > share and len(half.decompose()) == 1 for half in halves):
            return list(halves)
    return None


def _rough_half_space(rng: np.random.Generator, size: float, cut: str) -> tuple[Manifold, np.ndarray]:
    """A block whose upper side, near the origin, is a random plane with waves, as large as cuts anything of `size`; and
    the direction `(3,)` of that side."""
    roughness, power = CUTS[cut]
    direction = rng.normal(size=(WAVES, 2))
    length = size * np.geomspace(0.6, 0.06, WAVES)
    wave = 2 * np.pi * direction / np.linalg.norm(direction, axis=1, keepdims=True) / length[:, None]
    height = roughness * size * (length / length[0]) ** power * rng.normal(size=WAVES) / WAVES**0.5 * 2
    phase = rng.uniform(0, 2 * np.pi, WAVES)

    def rough(points: np.ndarray) -> np.ndarray:
        moved = np.array(points)
        bumps = (height * np.sin(moved[:, :2] @ wave.T + phase)).sum(1)
        moved[:, 2] += bumps * (1 + moved[:, 2] / (2 * size))
        return moved

    block = Manifold.cube((2.4 * size, 2.4 * size, 2 * size)).translate((-1.2 * size, -1.2 * size, -2 * size))
    quaternion = rng.normal(size=4)
    turn = np.column_stack([Rotation.from_quat(np.roll(quaternion, -1)).as_matrix(), np.zeros(3)])  # scipy: w is last
    return block.refine(CELLS).warp_batch(rough).transform(turn), turn[:, 2]


def _revolved(profile) -> Manifold:
    """A solid of revolution from its half profile, `(radius, height)` counter-clockwise."""
    return CrossSection([np.array(profile)]).revolve(SEGMENTS)


def _vessel(outline: np.ndarray, wall: float) -> Manifold:
    """Walls of `wall` metres within an outline of (radius, height), from the foot up."""
    outer = np.vstack([[0, outline[0, 1]], outline, [0, outline[-1, 1]]])
    inner = outline - [wall, 0]
    inner = inner[inner[:, 1] > outline[0, 1] + wall]
    inner = np.vstack([[0, outline[0, 1] + wall], [inner[0, 0], outline[0, 1] + wall], inner])
    inner = np.vstack([inner, [inner[-1, 0], outline[-1, 1] + wall], [0, outline[-1, 1] + wall]])
    return _revolved(outer) - _revolved(inner)


def _handle(reach: float, thick: float) -> Manifold:
    ring = CrossSection.circle(thick, 16).translate((reach, 0)).revolve(SEGMENTS // 2)
    return ring.rotate((90, 0, 0))


def _mug(rng) -> Manifold:
    radius, height, wall = rng.uniform(0.036, 0.046), rng.uniform(0.085, 0.11), rng.uniform(0.005, 0.007)
    levels = np.linspace(0, 1, 12)
    swell = 1 + rng.uniform(-0.06, 0.1) * np.sin(np.pi * levels)
    cup = np.column_stack([radius * swell, height * levels])
    solid = _revolved(np.vstack([[0, 0], cup, [0, height]]))
    hollow = solid - _vessel(cup, wall)
    return (solid + _handle(0.3 * height, wall).translate((radius, 0, 0.52 * height))) - hollow


def _bowl(rng) -> Manifold:
    radius, depth, wall = rng.uniform(0.06, 0.08), rng.uniform(0.05, 0.065), rng.uniform(0.006, 0.009)
    angles = np.linspace(0.35, np.pi / 2, 14)
    return _vessel(np.column_stack([radius * np.sin(angles), depth * (1 - np.cos(angles))]), wall)


def _vase(rng) -> Manifold:
    height, wall = rng.uniform(0.16, 0.2), rng.uniform(0.006, 0.008)
    belly, neck = rng.uniform(0.045, 0.058), rng.uniform(0.022, 0.028)
    at = np.array([0, 0.15, 0.4, 0.62, 0.8, 0.9, 1.0])
    wide = np.array([0.62 * belly, 0.85 * belly, belly, 0.75 * belly, neck, neck, 1.35 * neck])
    levels = np.linspace(0, 1, 30)
    return _vessel(np.column_stack([PchipInterpolator(at, wide)(levels), height * levels]), wall)


def _gravy_boat(rng) -> Manifold:
    long, wide, depth = rng.uniform(0.075, 0.09), rng.uniform(0.042, 0.05), rng.uniform(0.05, 0.06)
    wall = rng.uniform(0.006, 0.008)
    ball = Manifold.sphere(1.0, SEGMENTS)
    spout = ball.scale((0.035, 0.018, 0.03)).translate((long, 0, -0.006))
    thin = ball.scale((0.035 - wall, 0.018 - wall, 0.03)).translate((long, 0, 0))
    outer = ball.scale((long, wide, depth)) + spout
    inner = ball.scale((long - wall, wide - wall, depth - wall)) + thin
    foot = Manifold.cylinder(0.012, 0.03, 0.026, SEGMENTS).translate((0, 0, -depth - 0.004))
    handle = _handle(0.026, wall * 0.9).translate((-long, 0, -0.018))
    return (outer + foot + handle - inner).trim_by_plane((0, 0, -1), 0.0).decompose()[0]
