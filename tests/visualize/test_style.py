"""One style: what a colour means, and how small text is."""

import math

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

from rasp_core.visualize import style


@pytest.mark.parametrize(
    ("image", "target", "colour"),
    [(1, 1, (0, 0, 0)), (0, 0, (1, 1, 1)), (0, 1, style.MISSING), (1, 0, style.TOO_MUCH), (0.5, 0.5, (0.5, 0.5, 0.5))],
)
def test_a_difference_has_the_colours_of_its_meaning(image, target, colour):
    assert np.allclose(style.difference(np.full((2, 3), image), np.full((2, 3), target)), colour)


def test_the_colours_with_a_meaning_are_nobody_elses():
    apart = [matplotlib.colors.to_rgb(colour) for colour in style.OTHERS]
    for meaning in (style.MISSING, style.TOO_MUCH, style.OVERLAP):
        assert min(np.linalg.norm(np.subtract(other, meaning)) for other in apart) > 0.2


def test_the_smallest_text_is_found_where_it_is_drawn():
    figure = Figure()
    assert math.isinf(style.smallest_text(figure))
    axis = figure.subplots()
    axis.set_axis_off()
    axis.set_xlabel("hidden with its axes", fontsize=3)
    axis.set_title("a title", fontsize=14)
    assert style.smallest_text(figure) == 14
    axis.text(0, 0, "  ", fontsize=4)
    axis.text(0, 0, "$x^2$", fontsize=9)
    assert style.smallest_text(figure) == 9
    assert style.pixels_at_a_third(figure) == pytest.approx(9 / 72 * style.DPI / 3)


def test_a_figure_in_the_style_is_legible_at_a_third_of_its_size_and_a_plain_one_is_not():
    for use, legible in ((True, True), (False, False)):
        with matplotlib.rc_context():
            matplotlib.rcdefaults()
            if use:
                style.use()
            figure = Figure(layout="constrained")
            axis = figure.subplots()
            axis.plot([0, 1e-4], label="a curve")
            axis.set(title="title", xlabel="metres", ylabel="loss")
            axis.legend(title="legend")
            figure.suptitle("above")
            assert (style.pixels_at_a_third(figure) >= style.LEGIBLE_PX) is legible
