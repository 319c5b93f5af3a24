"""Plots have an axis for each thing that they show."""

from dataclasses import replace

import numpy as np
import pytest

from data_fetch import kitchen_like
from rasp_core.geometry.containers import box
from rasp_core.objective import LOSS_NAMES
from rasp_core.optimizer import optimize
from rasp_core.problem import Problem, Settings
from rasp_core.visualize import plots


@pytest.fixture(scope="module")
def found():
    return optimize(Problem(kitchen_like(2), box((0.3, 0.3, 0.3))), Settings(iterations=3, resolution=64))


def test_silhouettes_have_an_axis_each(found):
    figure = plots.silhouette_figure(found.targets, found.images, found.cameras)
    assert len(figure.axes) == 9
    assert figure.axes[3].images[0].get_array().shape == (64, 64)


def test_losses_have_an_axis_each(found):
    losses = plots.loss_figure(found)
    assert [axis.get_title() for axis in losses.axes] == ["silhouette", "overlap", "extrusion"]
    assert len(losses.axes[0].lines[0].get_ydata()) == 3


def test_the_overview_has_both_and_no_curves_without_iterations(found):
    assert len(plots.overview_figure(found).axes) == 9 + 3
    assert len(plots.overview_figure(replace(found, history=np.zeros((0, len(LOSS_NAMES))))).axes) == 9
    longer = plots.overview_figure(found, np.zeros((7, len(LOSS_NAMES))))
    assert len(longer.axes[-1].lines[0].get_ydata()) == 7
