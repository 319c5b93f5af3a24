"""The compiled loops by themselves: one point, and the pixels and layers that it is shared out over."""

import numpy as np
import pytest

from rasp_core.kernels.splat import pull, splat

SCENE = {
    "first": np.array([0, 1]),
    "volume": np.array([2.0]),
    "rotation": np.eye(3)[None, None],
    "translation": np.zeros((1, 1, 3)),
    "axes": np.array([[[1.0, 0, 0], [0, 0, 1], [0, 1, 0]]]),  # right x, up z, forward y
    "centres": np.zeros((1, 3)),
    "widths": np.array([4.0]),
}


def test_one_point_is_shared_out_linearly_over_eight_cells():
    """In a volume of 4 x 4 x 4 cells of edge 1 a point that lies a quarter of a cell right of a cell's centre."""
    images = np.zeros((1, 4, 4, 4))
    splat(0, 1, np.array([[0.75, 0.5, 0.5]]), *SCENE.values(), images)
    assert images[0, 2, 1, 2] == pytest.approx(2 * 0.75)
    assert images[0, 2, 1, 3] == pytest.approx(2 * 0.25)
    assert images.sum() == pytest.approx(2)


def test_beyond_the_picture_only_what_reaches_into_it_counts():
    images = np.zeros((1, 4, 4, 4))
    splat(0, 1, np.array([[1.75, 0.5, 0.5]]), *SCENE.values(), images)
    assert images.sum() == pytest.approx(2 * 0.75)
    splat(0, 1, np.array([[3.0, 0.5, 0.5]]), *SCENE.values(), images)
    assert images.sum() == pytest.approx(2 * 0.75)


def test_the_way_back_is_the_slope_of_what_the_cells_are_worth():
    upstream = np.zeros((1, 4, 4, 4))
    upstream[0, 2, 1, 3] = 1.0  # the cell to the right
    wrench = np.zeros((1, 1, 4, 3))
    point = np.array([[0.75, 0.5, 0.5]])
    pull(0, 1, upstream, point, *SCENE.values(), wrench)
    assert wrench[0, 0, 0, 0] == pytest.approx(2.0), "each metre to the right brings the whole volume"
    assert wrench[0, 0, 1:, 0].tolist() == pytest.approx([1.5, 1.0, 1.0]), "moments: point (outer) force"
