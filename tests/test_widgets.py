"""What the sliders do, through the plain functions behind them and through the widgets' own values."""

from dataclasses import replace

import ipywidgets

from data_fetch import kitchen_like
from rasp_core import widgets
from rasp_core.arrange import arrange
from rasp_core.containers import box
from rasp_core.problem import Problem, Settings

PROBLEM = Problem(kitchen_like(5), box((0.2, 0.2, 0.2)))
SETTINGS = Settings(iterations=30, query_points=5000, resolution=64)


def test_a_rerun_uses_the_given_lambda_and_epsilon():
    arrangement, picture, facts = widgets.rerun(PROBLEM, SETTINGS, 2.0, 0.005)
    expected = arrange(PROBLEM, replace(SETTINGS, lambda_=2.0, epsilon=0.005))
    assert (arrangement.matrices == expected.matrices).all()
    assert picture.startswith(b"\x89PNG")
    assert facts.startswith("density 0.")


def test_moving_a_slider_and_pressing_run_changes_picture_and_facts():
    box_ = widgets.lambda_epsilon_sliders(PROBLEM, SETTINGS)
    (lambda_, _, button), label, image = box_.children[0].children, box_.children[1], box_.children[2]
    assert isinstance(lambda_, ipywidgets.FloatLogSlider)
    before = (label.value, image.value)
    lambda_.value = 100.0
    button.click()
    assert not button.disabled
    assert (label.value, image.value) != before
