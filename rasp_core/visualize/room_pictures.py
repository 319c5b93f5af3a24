"""A heap in its room: a picture by lamps that are points, and a sheet with the measures to set it up by."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape

import numpy as np

from ..art.room import Room, Throw
from ..art.sculpture import Sculpture
from ..io import palette
from .installations import ORANGE, PLASTER, WARM
from .lamplight import Bulb, Surface, picture
from .scene3d import colours
from .style import OTHERS

MARGIN = 1.65  # of a picture's height: how large a piece of its surface is drawn
BLUR_DEG = 0.05  # of the lamps' rays
PLAN = 420  # pixels, the longer side of a plan


def in_room(room: Room, sculpture: Sculpture, scale: float, size: int = 1200) -> np.ndarray:
    """`(H, W, 3)` uint8: the heap between its lamps and surfaces, each shadow where its lamp throws it.

    scale : by what the heap's lengths are multiplied to be the room's.
    """
    hues = colours(len(sculpture.bodies))
    surfaces = [
        Surface(room.heap + scale * body.placed(matrix), body.solid_faces, hue)
        for body, matrix, hue in zip(sculpture.bodies, sculpture.matrices, hues, strict=True)
    ]
    patches = [_patch(throw, room.heap) for throw in room.throws]
    surfaces += [Surface(patch, np.array([[0, 1, 2], [0, 2, 3]]), PLASTER, body=False) for patch in patches]
    bulbs = []
    for k, throw in enumerate(room.throws):
        middle = throw.frame(room.heap)[0]
        half = np.degrees(np.arctan(0.75 * throw.height / np.linalg.norm(middle - throw.at)))
        bulbs.append(Bulb(throw.at, middle, half, WARM if k % 2 == 0 else ORANGE, BLUR_DEG))
    frame = np.concatenate([*patches, [room.heap - room.width / 2, room.heap + room.width / 2]])
    azimuth, elevation = _from_before(room)
    return picture(surfaces, bulbs, azimuth, elevation, size, 26.0, frame)


def _patch(throw: Throw, heap: np.ndarray) -> np.ndarray:
    """`(4, 3)` corners of a piece of a surface about its picture."""
    middle, right, up, _ = throw.frame(heap)
    half = MARGIN * throw.height / 2
    return np.array([middle + half * (a * right + b * up) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


def _from_before(room: Room) -> tuple[float, float]:
    """Azimuth and elevation, degrees, from where all surfaces are seen from before: against the mean of their normals,
    a little to the side."""
    toward = -np.sum([throw.frame(room.heap)[3] for throw in room.throws], axis=0)
    azimuth = np.degrees(np.arctan2(-toward[0], toward[1])) if np.linalg.norm(toward[:2]) > 1e-6 else 0.0
    elevation = np.degrees(np.arctan2(-toward[2], np.linalg.norm(toward[:2])))
    return float(azimuth) + (18.0 if len(room.throws) == 1 else 0.0), float(np.clip(elevation, 18.0, 60.0))


def sheet(room: Room, size: np.ndarray, scale: float, shadows: np.ndarray, likeness: Sequence[float]) -> str:
    """A page in HTML that needs nothing else: where heap, lamps and shadows go, in metres.

    size `(3,)` : the heap's extent. shadows `(K, H, H)` bool: what is dark on the surfaces.
    """
    rows = [("heap, its middle", _triple(room.heap)), ("heap, its size", _triple(size))]
    rows.append(("objects", f"at {scale:.4g} of the size that their files have"))
    blocks = []
    for k, (throw, alike) in enumerate(zip(room.throws, likeness, strict=True), 1):
        middle, right, up, normal = throw.frame(room.heap)
        to_heap, to_middle = (np.linalg.norm(x - throw.at) for x in (room.heap, middle))
        tilt = np.degrees(np.arccos(np.clip(abs(normal[2]), 0, 1)))
        rows += [
            (f"lamp {k}, at", _triple(throw.at)),
            (f"lamp {k}, to the heap's middle", f"{to_heap:.3f} m"),
            (f"lamp {k}, to the shadow's middle", f"{to_middle:.3f} m"),
            (f"lamp {k}, before the {throw.surface.name}, straight", f"{abs((throw.at - middle) @ normal):.3f} m"),
            (f"{throw.surface.name}, against the floor's level", f"{tilt:.1f} degrees"),
            (f"shadow {k}, its middle on the {throw.surface.name}", _triple(middle)),
            (f"shadow {k}, its square's edge", f"{throw.height:.3f} m"),
            (f"shadow {k}, its top left corner", _triple(middle + throw.height / 2 * (up - right))),
            (f"shadow {k}, like its picture", f"{alike:.1%}"),
        ]
        pixels = np.where(shadows[k - 1][..., None], np.uint8(40), np.uint8(235)).repeat(3, 2)
        data = base64.b64encode(palette.png(pixels)).decode()
        name = escape(throw.surface.name)
        blocks.append(
            f'<figure><img width="220" alt="shadow {k}" src="data:image/png;base64,{data}"/>'
            f"<figcaption>Shadow {k}, on the {name}, as seen from its lamp's side</figcaption></figure>"
        )
    table = "".join(f"<tr><th>{escape(a)}</th><td>{escape(b)}</td></tr>" for a, b in rows)
    plans = _plan(room, size, (0, 1), "From above: x to the right, y up") + _plan(
        room, size, _side(room), "From the side: z up"
    )
    return (
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>A heap in its room</title><style>'
        "body{font:15px sans-serif;max-width:62em;margin:2em auto;padding:0 1em}th{text-align:left;font-weight:normal;"
        "padding-right:1.5em}td{font-variant-numeric:tabular-nums}figure{display:inline-block;margin:0 1.5em 1em 0}"
        "</style></head><body><h1>A heap in its room</h1><p>Metres, z up, in the coordinates of the room's file.</p>"
        f"<div>{plans}</div><table>{table}</table><div>{''.join(blocks)}</div></body></html>\n"
    )


def _triple(place: np.ndarray) -> str:
    return "  ".join(f"{name} {value:.3f}" for name, value in zip("xyz", place, strict=True)) + " m"


def _side(room: Room) -> tuple[int, int]:
    """The axes of a side view: the level one along which things are farther apart, and z."""
    places = np.array([room.heap, *(t.at for t in room.throws), *(t.frame(room.heap)[0] for t in room.throws)])
    return int(np.argmax(np.ptp(places[:, :2], axis=0))), 2


def _plan(room: Room, size: np.ndarray, axes: tuple[int, int], title: str) -> str:
    """An SVG of the room along an axis: the heap's box, lamps, their rays through the heap, and the shadows' edges."""
    a, b = axes
    patches = [_patch(throw, room.heap) for throw in room.throws]
    points = np.concatenate([*patches, [throw.at for throw in room.throws], [room.heap - size, room.heap + size]])
    low, high = (f(points, axis=0)[[a, b]] for f in (np.min, np.max))
    unit = PLAN / float((high - low).max())
    pad = 28

    def at(place: np.ndarray) -> tuple[float, float]:
        return pad + unit * (place[a] - low[0]), pad + unit * (high[1] - place[b])

    (x, y), (u, v) = at(room.heap - size / 2), at(room.heap + size / 2)
    heap = f'<rect x="{x:.1f}" y="{v:.1f}" width="{u - x:.1f}" height="{y - v:.1f}" fill="{OTHERS[0]}"'
    drawn = [f'{heap} fill-opacity="0.5"/>']
    for k, (throw, patch) in enumerate(zip(room.throws, patches, strict=True), 1):
        middle, right, up, _ = throw.frame(room.heap)
        half = throw.height / 2
        square = [middle + half * (i * right + j * up) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        for corners, style in ((patch, "#ccc"), (square, "#333")):
            path = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(at, corners))
            drawn.append(f'<polygon points="{path}" fill="{style}" fill-opacity="0.25" stroke="{style}"/>')
        (x, y), (u, v) = at(throw.at), at(middle)
        drawn.append(f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{u:.1f}" y2="{v:.1f}" stroke="#c80" stroke-dasharray="4"/>')
        drawn.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="#fb0"/>')
        drawn.append(f'<text x="{x + 9:.1f}" y="{y - 6:.1f}" font-size="13">lamp {k}</text>')
        drawn.append(f'<text x="{u + 5:.1f}" y="{v - 5:.1f}" font-size="13">shadow {k}</text>')
    wide, tall = (unit * (high - low) + 2 * pad).round()
    return (
        f'<figure><svg width="{wide:.0f}" height="{tall:.0f}" font-family="sans-serif">{"".join(drawn)}</svg>'
        f"<figcaption>{title}</figcaption></figure>"
    )
