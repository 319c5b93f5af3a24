import numpy as np

from data_fetch import portraits, shapes


def test_shapes_are_of_one_height_and_in_the_middle():
    found = shapes(200)
    assert set(found) == {"heart", "star", "moon"}
    for image in found.values():
        rows = np.flatnonzero(image.any(1))
        assert abs(rows[0] - 20) <= 2
        assert abs(rows[-1] - 179) <= 2


def test_a_star_has_five_points_and_the_area_of_a_pentagram():
    star = shapes(400)["star"]
    assert star[star.any(1)][:3].sum() < 20, "one point is up"
    # a pentagram about a circle of radius R has the area 1.12257 R^2
    radius = 0.8 / 2 / 0.905 * 400
    assert abs(star.sum() / radius**2 / 1.12257 - 1) < 0.02
    assert np.abs(star.astype(int) - star[:, ::-1]).mean() < 0.01


def test_portraits_have_colours_in_an_oval():
    found = portraits(120)
    assert found.shape == (2, 120, 120, 4)
    for picture in found:
        assert abs((picture[..., 3] == 255).mean() - np.pi / 4 * 0.66 * 0.84) < 0.01
        assert picture[..., :3][picture[..., 3] == 255].std() > 30
