"""Figures in these tests are drawn in the kit's style, and leave matplotlib as it was."""

import matplotlib
import pytest

from rasp_core.visualize import style


@pytest.fixture(autouse=True)
def in_style():
    with matplotlib.rc_context():
        style.use()
        yield
