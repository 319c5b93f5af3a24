"""Ink and ground of drawings whose shape is known by construction."""

import numpy as np
import pytest
from scipy import ndimage

from rasp_core.io.ink import find_ink
from rasp_core.util.errors import InputError

N = 160
Y, X = np.mgrid[0:N, 0:N] / (N - 1)
RADIUS = np.hypot(X - 0.4, Y - 0.45)
SHAPE = (RADIUS < 0.25) & (RADIUS > 0.1) | (abs(X - 0.6) < 0.08) & (abs(Y - 0.6) < 0.3)
OPAQUE = np.ones((N, N), np.float32)
VIGNETTE = 1 - 1.4 * ((X - 0.5) ** 2 + (Y - 0.5) ** 2)


def drawn(paper, ink, light=1.0, noise=0.0, shape=SHAPE):
    grain = noise * np.random.default_rng(0).normal(size=(N, N))
    grey = np.clip(np.where(shape, ink, paper) * light + grain, 0, 1)
    return np.repeat(grey[..., None], 3, 2).astype(np.float32)


def shown(colour, alpha=OPAQUE):
    found = find_ink(colour, np.asarray(alpha, np.float32))
    return found.coverage > 0.5, " ".join(found.guesses)


@pytest.mark.parametrize("values", [(1, 0), (1, 0.7), (1, 0.93), (0.5, 0.3), (1, np.where(X < 0.5, 0.1, 0.6))])
def test_even_drawings_come_out_exactly_and_without_a_guess(values):
    mask, guesses = shown(drawn(*values))
    assert np.array_equal(mask, SHAPE)
    assert not guesses


def test_a_plain_threshold_decides_about_soft_edges():
    soft = ndimage.gaussian_filter(drawn(1, 0), (1, 1, 0))
    assert np.array_equal(shown(soft)[0], soft[..., 0] < 0.5)


def test_colours_as_bright_as_their_ground():
    colour = np.where(SHAPE[..., None], [0.8, 0.3, 0.2], [0.3, 0.8, 0.2]).astype(np.float32)
    assert np.array_equal(shown(colour)[0], SHAPE)


def test_light_on_dark_is_told():
    mask, guesses = shown(drawn(0.1, 0.9))
    assert np.array_equal(mask, SHAPE)
    assert "light on dark" in guesses


@pytest.mark.parametrize("light", [VIGNETTE, 0.25 + 0.75 * X, 0.4 + 0.3 * (X + Y), 1 / (1 + (1 - VIGNETTE)) ** 4])
@pytest.mark.parametrize("ink", [0.15, 0.5])
def test_uneven_light_is_evened_out_and_told(light, ink):
    mask, guesses = shown(drawn(0.95, ink, light, 0.01))
    assert (mask == SHAPE).mean() > 0.998
    assert "evened out" in guesses


def test_chalk_in_uneven_light():
    mask, guesses = shown(drawn(0.2, 0.9, 0.3 + 0.7 * X, 0.005))
    assert (mask == SHAPE).mean() > 0.998
    assert "light on dark" in guesses


def test_heavy_grain_is_smoothed_and_told():
    mask, guesses = shown(drawn(0.8, 0.25, 0.6 + 0.4 * Y, 0.1))
    assert (mask == SHAPE).mean() > 0.98
    assert "smoothed" in guesses


def test_lines_without_a_flat_inside():
    lines = (abs(RADIUS - 0.3) < 0.008) | (abs(X - Y) < 0.006) & (RADIUS < 0.3)
    assert np.array_equal(shown(drawn(1, 0.2, shape=lines))[0], lines)


def test_a_checkerboard_that_stands_for_transparency_is_ground():
    board = np.where((10 * X).astype(int) + (10 * Y).astype(int) & 1, 0.8, 1)
    assert (shown(drawn(board, 0))[0] == SHAPE).all()


def test_faint_parts_that_are_left_out_are_told():
    mark = (abs(X - 0.85) < 0.1) & (abs(Y - 0.2) < 0.1)
    mask, guesses = shown(drawn(np.where(mark, 0.96, 1), 0))
    assert np.array_equal(mask, SHAPE)
    assert "faintest parts" in guesses


def test_a_ruled_ground_is_told_as_faint():
    mask, guesses = shown(drawn(np.where(np.arange(N)[:, None] % 16 == 0, 0.7, 1) * np.ones((N, N)), 0.1))
    assert np.array_equal(mask, SHAPE)
    assert "faintest parts" in guesses


def test_a_shape_that_touches_much_of_the_border_is_told():
    bust = (Y > 0.5) & (abs(X - 0.5) < 0.35)
    mask, guesses = shown(drawn(1, 0, shape=bust))
    assert np.array_equal(mask, bust)
    assert "touches much of the border" in guesses


def test_a_coloured_thing_on_white_is_taken_whole():
    grain = np.random.default_rng(1).uniform(0, 0.9, (N, N, 1)).astype(np.float32)
    mask, guesses = shown(np.where(SHAPE[..., None], grain, 1))
    assert (mask == SHAPE).mean() > 0.995
    assert "fades into its ground" in guesses


def test_a_blur_without_a_step_is_taken_from_the_border_and_told():
    glow = np.exp(-(RADIUS**2) / 0.02)
    mask, guesses = shown(drawn(1 - glow, 0, shape=np.zeros((N, N), bool)))
    assert np.array_equal(mask, glow > 0.1)
    assert "fades into its ground" in guesses


@pytest.mark.parametrize("strength", [1.0, 100 / 255, np.where(Y < 0.5, 1, 0.35), 0.3 + 0.7 * Y])
@pytest.mark.parametrize("ink", [0.0, 1.0])
def test_alpha_tells_however_faint(strength, ink):
    mask, guesses = shown(drawn(1, ink), SHAPE * strength)
    assert np.array_equal(mask, SHAPE)
    assert not guesses


def test_a_cast_shadow_in_alpha_is_no_ink():
    shadow = 0.5 * ndimage.gaussian_filter(np.roll(SHAPE.astype(float), 5, (0, 1)), 8)
    assert np.array_equal(shown(drawn(1, 0), np.maximum(SHAPE, shadow))[0], SHAPE)


def test_alpha_that_fades_out():
    glow = np.exp(-(RADIUS**2) / 0.02)
    assert np.array_equal(shown(drawn(1, 0), glow)[0], glow > glow.max() / 4)


def test_alpha_of_the_paper_says_nothing_about_the_ink():
    paper = np.where(RADIUS < 0.65, 1.0, 0.0)
    assert np.array_equal(shown(drawn(1, 0), paper)[0], SHAPE)
    assert np.array_equal(shown(drawn(1, 0), np.full((N, N), 0.5))[0], SHAPE)


def test_a_hole_in_a_sheet_is_the_shape():
    mask, guesses = shown(np.ones((N, N, 3), np.float32), ~SHAPE)
    assert np.array_equal(mask, SHAPE)
    assert "hole" in guesses


@pytest.mark.parametrize(
    ("message", "colour", "alpha"),
    [
        ("is blank: it is transparent all over", drawn(1, 0), 0 * OPAQUE),
        ("is blank: it shows one colour only", drawn(0.4, 0.4), OPAQUE),
        ("is blank: it shows nothing but its ground", drawn(0.9, 0.9, 0.4 + 0.6 * X, 0.004), OPAQUE),
        ("cannot be told", np.random.default_rng(0).random((N, N, 3)).astype(np.float32), OPAQUE),
        ("cannot be told", drawn(0.5 + 0.4 * np.sin(20 * X) * np.cos(17 * Y), 0.4, noise=0.05), OPAQUE),
    ],
)
def test_refused(message, colour, alpha):
    with pytest.raises(InputError, match=message):
        find_ink(colour, alpha)
