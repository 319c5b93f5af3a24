"""What a notebook shows of a result holds its picture, and is safe to show."""

import base64
import io
import re

import numpy as np
from PIL import Image

from data_fetch import kitchen_like
from rasp_core.geometry.containers import box
from rasp_core.visualize.summary import SIZE, picture_html, table_html


def test_the_picture_is_in_the_page_and_small():
    html = picture_html(kitchen_like(3), np.tile(np.eye(4), (3, 1, 1)), box((0.3, 0.3, 0.3)))
    data = base64.b64decode(re.search(r"base64,([^\"]+)", html).group(1))
    with Image.open(io.BytesIO(data)) as picture:
        assert picture.size == SIZE
        assert np.asarray(picture.convert("RGB")).std() > 1, "something is drawn"
    assert len(data) < 60_000


def test_names_and_values_are_escaped():
    html = table_html({"a <b>": "1 & 2", "c": "</table>"})
    assert "a &lt;b&gt;" in html
    assert "1 &amp; 2" in html
    assert html.count("</table>") == 1
    assert html.count("<tr>") == 2
