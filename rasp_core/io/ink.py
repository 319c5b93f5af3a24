"""What of a picture is ink and what is ground, as a person would tell them apart."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..util.errors import InputError

LEAST = 0.03  # of full brightness: the least step between ground and ink
LINES = 0.1  # the least for ink that has no flat inside: lines, dots
EVEN = 0.04  # root mean square around one colour of what counts as an even ground
UNEVEN = 0.12  # the most that may be left where light was evened out
NOISE = 3.0  # a step is this often as high as the ground's root mean square
FAINT = 1 / 12  # of the highest step: lower ones (watermarks, paper's texture) belong to the ground
TOUCH = (0.1, 0.25, 0.5)  # of the border ring may be ink: rather less than more
CLEAN = 0.01  # root mean square of a ground without noise
BETWEEN = (0.1, 2.0)  # of the ink's area that is neither: a coloured thing if more; at most
OUTLINE = 3  # pixels: outlines are no wider
GRAIN = 2.0  # pixels over which noise is smoothed if ink cannot be told otherwise
FADES = "fades into its ground; all that differs from the border's colour is taken as the shape"
FLAT = 0.08  # of the strongest alpha, within a shadow
LEVELS = 256
DARKEST = 0.04  # of white: light is not evened out below
UNTOLD = "what is ink cannot be told from its ground; give a drawing on an even ground or with transparency around it"


@dataclass(frozen=True)
class Ink:
    """coverage `(H, W)` float32 in [0, 1], ink where it is over a half. ground `(3,)` float32: the colour around it.
    guesses : what was decided without certainty, for the user to know.
    """

    coverage: np.ndarray
    ground: np.ndarray
    guesses: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Step:
    """Ink lies further from the ground than `at`; `spread` is the ground's root mean square around its colour."""

    at: float
    spread: float
    fainter: bool  # a lower step was passed over


def find_ink(colour: np.ndarray, alpha: np.ndarray) -> Ink:
    """The ink of a picture whose colours on white are `(H, W, 3)` and whose alpha is `(H, W)`, float32 in [0, 1].

    Alpha tells where it is clear along most of the border. Otherwise the border's colour is the ground, and ink is
    what differs from it by a step that stands out from the ground's own unevenness; if the light is uneven, it is
    evened out first. Raises InputError, without the file's name, for blank pictures and where there is no such step.
    """
    if alpha.max() < LEAST:
        raise InputError("is blank: it is transparent all over")
    from scipy import ndimage

    ground = np.median(_ring(colour), axis=0)
    if np.median(_ring(alpha)) < alpha.max() / 2 and np.ptp(alpha) >= LEAST:
        step = _step(alpha, FLAT * float(alpha.max()))
        # Where ink fades out evenly, the least that can be seen is ink.
        return Ink(_coverage(alpha, step.at if step else alpha.max() / 4), ground, _fainter(step))
    plain = np.abs(colour - ground).max(-1)
    if plain.max() < LEAST:
        return _hole(alpha, ground)
    step = _step(plain)
    if step is None or step.spread > EVEN:
        flattened = _flattened(colour)
        even = _step(flattened)
        if even and even.spread <= (step.spread if step else UNEVEN):
            return _ink(colour, flattened, ground, even, "the light is uneven and was evened out")
    if step:
        return _ink(colour, plain, ground, step)
    if np.percentile(flattened, 99.95) < LINES:
        raise InputError("is blank: it shows nothing but its ground")
    if (_ring(plain) < LEAST).mean() >= 1 - TOUCH[0] and plain.max() > LINES:
        return _ink(colour, plain, ground, _Step(LINES, 0, False), FADES)
    flattened = _flattened(np.stack([ndimage.gaussian_filter(c, GRAIN) for c in np.moveaxis(colour, -1, 0)], -1))
    step = _step(flattened)
    if step is None or step.fainter or step.spread > EVEN:
        raise InputError(UNTOLD)
    return _ink(colour, flattened, ground, step, "the light is uneven or grainy and was smoothed")


def _ink(colour: np.ndarray, apart: np.ndarray, ground: np.ndarray, step: _Step, *guesses: str) -> Ink:
    """The ink beyond this step, and what else was guessed."""
    at, ink = step.at, apart > step.at
    ring = _ring(apart)
    if _between(apart, step) > BETWEEN[0] * ink.sum():
        if step.spread <= CLEAN and (ring > LINES / 2).mean() < CLEAN:
            at, guesses = LINES / 2, (*guesses, FADES)
        else:
            step = _Step(at, step.spread, True)
    if (ring > at).mean() > TOUCH[0]:
        guesses = (*guesses, "its shape touches much of the border; if a shadow or a table was taken for it, crop it")
    if colour[ink].mean() > ground.mean():
        guesses = (*guesses, "is light on dark; the light part is taken as the shape")
    return Ink(_coverage(apart, at), ground, _fainter(step) + guesses)


def _hole(alpha: np.ndarray, ground: np.ndarray) -> Ink:
    """A hole in a sheet of one colour."""
    clear = alpha.max() - alpha
    step = _step(clear)
    if step is None:
        raise InputError("is blank: it shows one colour only; ink differs from its ground")
    return Ink(_coverage(clear, step.at), ground, ("the hole in it is taken as the shape",))


def _coverage(apart: np.ndarray, at: float) -> np.ndarray:
    return np.clip(apart / (2 * at), 0, 1).astype(np.float32)


def _fainter(step: _Step | None) -> tuple[str, ...]:
    return ("its faintest parts are taken as ground",) if step and step.fainter else ()


def _between(apart: np.ndarray, step: _Step) -> int:
    """How many pixels stand out from the ground but are neither ink nor its outline: shading inside or around it."""
    from scipy import ndimage

    ink, seen, square = apart > step.at, apart > max(LINES / 2, NOISE * step.spread), np.ones((3, 3))
    beside = ndimage.binary_dilation(ink, square, OUTLINE) & ~ndimage.binary_erosion(seen, square, 2 * OUTLINE)
    return int((seen & ~ink & ~beside & (_relief(apart) > EVEN)).sum())


def _ring(image: np.ndarray) -> np.ndarray:
    """The pixels `(N, ...)` along the border, some deep, so that a hairline around the picture does not count."""
    deep = max(1, min(image.shape[:2]) // 40)
    middle = image[deep:-deep]
    sides = (image[:deep], image[-deep:], middle[:, :deep], middle[:, -deep:])
    return np.concatenate([side.reshape(-1, *image.shape[2:]) for side in sides])


def _step(apart: np.ndarray, level: float = EVEN) -> _Step | None:
    """The lowest clear step from ground to ink in the distance from the ground `(H, W)`.

    The levels that a picture has are those of its flat parts: the slopes at edges, the ringing of JPEG and blurred
    outlines hold every level. Ground's levels begin at 0; a step is a range without flat parts. Halfway up is ink.
    level : the most by which neighbours in a flat part differ, besides noise.
    """
    relief = _relief(apart)
    flat = apart[relief <= level + 1.5 * np.median(relief)]
    count, edges = np.histogram(flat, LEVELS, (0, max(float(apart.max()), LEAST)))
    centre = (edges[1:] + edges[:-1]) / 2
    exact = np.bincount(np.digitize(flat, edges[1:-1]), flat, LEVELS) / np.maximum(count, 1)
    held = np.flatnonzero(count > max(2, 2e-4 * flat.size))
    # Thin lines have no flat inside: their tops are a level all the same.
    top = float(np.percentile(apart, 99.95))
    levels = np.append(exact[held], max(top, exact[held[-1]] if len(held) else 0.0))
    ring = _ring(apart)
    found = []
    highest = np.diff(levels).max(initial=0.0)
    for k, (low, high) in enumerate(pairwise(levels)):
        below = flat[flat <= max(centre[held[k]], low) + 1e-6]
        spread = float(np.sqrt(np.mean(below**2))) if below.size else 0.0
        least = LINES if k == len(held) - 1 else LEAST
        if high - low >= max(least, NOISE * spread):
            found.append((high - low >= FAINT * highest, (low + high) / 2, spread))
    for most in TOUCH:
        for k, (clear, at, spread) in enumerate(found):
            step = _Step(at, spread, k > 0)
            if most > TOUCH[1] and spread > CLEAN:
                continue  # a photograph's shadow or table
            if clear and (ring > at).mean() < most and _between(apart, step) <= BETWEEN[1] * (apart > at).sum():
                return step
    return None


def _relief(image: np.ndarray) -> np.ndarray:
    """How far the values within one pixel of each lie apart."""
    from scipy import ndimage

    return ndimage.maximum_filter(image, 3) - ndimage.minimum_filter(image, 3)


def _flattened(colour: np.ndarray) -> np.ndarray:
    """The distance `(H, W)` from the ground, as a share of it, if the ground `(H, W, 3)` is a smooth surface.

    Light multiplies, so a polynomial is fitted to the logarithm: of degree 2 to the border, then of degree 4 to all
    that is close to the surface so far, ever closer.
    """
    from numpy.polynomial.polynomial import polygrid2d

    height, width = colour.shape[:2]
    every = max(1, max(height, width) // 128)
    y, x = np.linspace(-1, 1, height), np.linspace(-1, 1, width)
    down, across = np.meshgrid(y[::every], x[::every], indexing="ij")
    ring_down, ring_across = _ring(np.stack([down, across], -1)).T
    apart = np.zeros((height, width))
    for channel in np.moveaxis(colour, -1, 0)[: 3 if np.ptp(colour, axis=-1).any() else 1]:
        value = np.log(np.maximum(channel[::every, ::every], DARKEST))
        border = _ring(value)
        surface = _fit(ring_down, ring_across, border, 2)
        surface = _refit(ring_down, ring_across, border, 2, surface)
        surface = _refit(down.ravel(), across.ravel(), value.ravel(), 4, surface)
        light = np.exp(np.clip(polygrid2d(y, x, surface), np.log(DARKEST), np.log(2)))
        apart = np.maximum(apart, np.abs(channel / light - 1))
    return apart


def _refit(y: np.ndarray, x: np.ndarray, value: np.ndarray, degree: int, surface: np.ndarray) -> np.ndarray:
    """The surface fitted anew to the values that are close to it, ever closer; ink is left out so."""
    from numpy.polynomial.polynomial import polyval2d

    for close in (0.4, 0.25, 0.15):
        away = np.abs(value - polyval2d(y, x, surface))
        near = away <= max(close, np.percentile(away, 25))
        surface = _fit(y[near], x[near], value[near], degree)
    return surface


def _fit(y: np.ndarray, x: np.ndarray, value: np.ndarray, degree: int) -> np.ndarray:
    """Coefficients `(degree + 1, degree + 1)` of the powers of y and x together up to the degree, by least squares."""
    powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    surface = np.zeros((degree + 1, degree + 1))
    columns = np.stack([y**i * x**j for i, j in powers], -1)
    surface[tuple(zip(*powers, strict=True))] = np.linalg.lstsq(columns, value, rcond=None)[0]
    return surface
