"""What is wished of a part: how it may be turned, whether it must go in, what it keeps clear, its colour."""

from __future__ import annotations

from dataclasses import dataclass

import manifold3d
import numpy as np
from scipy.spatial.transform import Rotation

from ..util.errors import InputError

FLAT = "flat:"
WORDS = f"any, z, 90, {FLAT}N, none, or angles about x, y and z in degrees, such as 0 0 0; 90 0 0"
SAME_NORMAL = 4  # decimals to which the normals of faces that are one agree


def quarter_turns() -> np.ndarray:
    """The 24 rotations that map axes onto axes, `(24, 3, 3)`, the identity first."""
    found = []
    for axes in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)):
        for signs in np.ndindex(2, 2, 2):
            turn = np.zeros((3, 3))
            turn[range(3), axes] = 1 - 2 * np.array(signs)
            if np.linalg.det(turn) > 0:
                found.append(turn)
    return np.array(found)


@dataclass(frozen=True, eq=False)
class Turns:
    """Turns that a part may have, from its file to the world.

    word : as the user has it. bases `(B, 3, 3)` : rotations. about_z : each with any turn about the vertical after it.
    """

    word: str
    bases: np.ndarray
    about_z: bool

    @property
    def freedom(self) -> np.ndarray:
        """`(3,)`: 1 for the world's axes about which it may be turned a little, 0 for others."""
        return np.array([0.0, 0.0, float(self.about_z)])

    def random(self, random: np.random.Generator) -> np.ndarray:
        """One of them, `(3, 3)`."""
        base = self.bases[random.integers(len(self.bases))]
        return _about_z(random.uniform(0, 2 * np.pi)) @ base if self.about_z else base

    def straight(self) -> np.ndarray:
        """`(T, 3, 3)`: the bases, where they may be turned about the vertical by quarters of a turn."""
        quarters = [np.round(_about_z(k * np.pi / 2)) for k in range(4 if self.about_z else 1)]
        return np.array([quarter @ base for base in self.bases for quarter in quarters])

    def nearest(self, rotation: np.ndarray) -> np.ndarray:
        """The one of them nearest to a rotation `(3, 3)`."""
        likely = []
        for base in self.bases:
            turn = rotation @ base.T
            angle = np.arctan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1]) if self.about_z else 0.0
            likely.append(_about_z(angle) @ base if self.about_z else base)
        return max(likely, key=lambda one: float((one * rotation).sum()))


@dataclass(frozen=True)
class Wishes:
    """What is wished of one part.

    turns : None for any. must : it goes in before others, or the packing is said to lack it. priority : of the others
    the larger go in first. clearance : metres, None for that of all. colour : red, green, blue in [0, 1], None for one
    of the kit's. fixed : it was there before, and stays where its file has it.
    """

    turns: Turns | None = None
    must: bool = False
    priority: float = 0.0
    clearance: float | None = None
    colour: tuple[float, float, float] | None = None
    fixed: bool = False


NO_WISHES = Wishes()


def turns_of(word: str, solid: manifold3d.Manifold) -> Turns | None:
    """The turns of a word for a body's solid, None for any.

    any; z: about the vertical; 90: the 24 that map axes onto axes; flat:N: one of the N largest faces of its convex
    hull down, and any turn about the vertical; none: as in the file; or those of a list, as `_listed` has it. Raises
    InputError for other words.
    """
    word = word.strip().lower()
    check_turns(word)
    if word == "any":
        return None
    if word == "90":
        return Turns(word, quarter_turns(), False)
    if word.startswith(FLAT):
        return Turns(word, _faces_down(solid, int(word.removeprefix(FLAT))), True)
    if (listed := _listed(word)) is not None:
        return Turns(word, listed, False)
    return Turns(word, np.eye(3)[None], word == "z")


def check_turns(word: str) -> None:
    """Raise InputError unless it is a word that `turns_of` knows."""
    count = word.removeprefix(FLAT)
    if word in ("any", "z", "90", "none") or (word.startswith(FLAT) and count.isdecimal() and int(count) > 0):
        return
    if _listed(word) is not None:
        return
    raise InputError(f"turns must be {WORDS}, got {word!r}")


def _listed(word: str) -> np.ndarray | None:
    """Rotations `(B, 3, 3)` of triples of degrees between semicolons, about the world's x first, then y, then z; None
    if it is no such list."""
    try:
        degrees = np.array([[float(angle) for angle in one.split()] for one in word.split(";")])
    except ValueError:  # no numbers, or not as many in each
        return None
    if degrees.ndim != 2 or degrees.shape[1] != 3 or not np.isfinite(degrees).all():
        return None
    return Rotation.from_euler("xyz", degrees, degrees=True).as_matrix()


def _about_z(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


def _faces_down(solid: manifold3d.Manifold, count: int) -> np.ndarray:
    """Rotations `(B, 3, 3)` that put the largest faces of a solid's convex hull down, at most `count`."""
    mesh = solid.hull().to_mesh64()
    corners = np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts)]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    size = np.linalg.norm(area, axis=1)
    area, size = area[size > 0], size[size > 0]
    normal = area / size[:, None]
    _, kind = np.unique((normal + 0.0).round(SAME_NORMAL) + 0.0, axis=0, return_inverse=True)
    total = np.bincount(kind.ravel(), size)
    found = []
    for one in np.argsort(-total, kind="stable")[:count]:
        mean = area[kind.ravel() == one].sum(0)
        found.append(_down(mean / np.linalg.norm(mean)))
    return np.array(found)


def _down(normal: np.ndarray) -> np.ndarray:
    """The least rotation that turns a unit vector `(3,)` down."""
    axis, cosine = np.cross(normal, (0, 0, -1)), float(-normal[2])
    if cosine < -1 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    x, y, z = axis
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + skew + skew @ skew / (1 + cosine)
