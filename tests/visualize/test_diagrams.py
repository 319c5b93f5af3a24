"""The diagram names every part of the method, legibly, with a picture in each box."""

import matplotlib
import numpy as np

from rasp_core.visualize import diagrams, style


def test_the_diagram_has_all_parts_and_its_pictures():
    grey = np.full((20, 30), 0.5)
    pictures = {"objects": [grey], "poses": [grey], "shadows": [grey, grey.T], "fields": [grey]}
    with matplotlib.rc_context(dict(style.RC)):
        figure = diagrams.pipeline(pictures)
        words = " ".join(text.get_text() for text in figure.axes[0].texts)
        for part in ("objects", "poses", "renderer", "signed distances", "sil", "is}", "ext", "Adam", "gradient"):
            assert part in words
        assert style.pixels_at_a_third(figure) >= style.LEGIBLE_PX
    inner = figure.axes[1:]
    assert len(inner) == 5
    for axis in inner:
        high, wide = axis.images[0].get_array().shape[:2]
        box = axis.get_window_extent()
        assert abs(box.width / box.height - wide / high) < 1e-6
    boxes = [axis.get_window_extent() for axis in inner]
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])
