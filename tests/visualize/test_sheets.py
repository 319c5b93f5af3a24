"""Rows of pictures fill the page."""

import io

import numpy as np
import pytest
from PIL import Image

from rasp_core.visualize import sheets


def drawn(figure):
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=50)
    return np.asarray(Image.open(data).convert("RGB"))


def test_rows_are_full_and_pictures_keep_their_shapes():
    red, blue = np.zeros((40, 20, 3)), np.zeros((10, 30, 3))
    red[..., 0], blue[..., 2] = 1, 1
    figure, axes = sheets.sheet([[("", red), ("", blue)], [("", blue)]], wide=6.0)
    assert [len(row) for row in axes] == [2, 1]
    for row in axes:
        boxes = [axis.get_window_extent() for axis in row]
        assert boxes[0].x0 == pytest.approx(0, abs=1e-6)
        assert boxes[-1].x1 == pytest.approx(figure.bbox.width)
        assert np.ptp([box.height for box in boxes]) < 1e-6
        for axis, box in zip(row, boxes, strict=True):
            high, wide = axis.images[0].get_array().shape[:2]
            assert box.width / box.height == pytest.approx(wide / high)
    pixels = drawn(figure)
    for edge in (pixels[2], pixels[-3], pixels[:, 2], pixels[:, -3]):
        assert (edge < 128).any(1).mean() > 0.9, "no white margin"


def test_titles_and_labels_are_legible_and_beside_the_pictures():
    black = np.zeros((20, 20))
    figure, ((first, plot),) = sheets.sheet([[("one\ntwo", black), ("a plot", 1.5)]], ["row"], wide=9.0)
    plot.plot([0, 1])
    assert sorted(text.get_text() for text in figure.texts) == ["a plot", "one\ntwo", "row"]
    picture = first.get_window_extent()
    for text in figure.texts:
        box = text.get_window_extent()
        assert not box.overlaps(picture)
        assert not box.overlaps(plot.get_window_extent())
        assert 0 <= box.x0 <= box.x1 <= figure.bbox.width
        assert 0 <= box.y0 <= box.y1 <= figure.bbox.height
