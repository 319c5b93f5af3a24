"""What a notebook shows of a result: a picture and a small table, as HTML that needs nothing else."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..io import palette
from . import scene3d

SIZE = (480, 400)  # pixels


def picture_html(bodies: Sequence[Body], matrices: np.ndarray, container: Container | None = None, **look) -> str:
    """An `<img>` of bodies placed by `matrices` `(N, 4, 4)`, in few colours, with the picture in it.

    look : further arguments of `scene3d.Stage`.
    """
    pixels = scene3d.scene_picture(bodies, matrices, container, SIZE, **look)
    data = base64.b64encode(palette.png(pixels)).decode()
    return f'<img width="{SIZE[0]}" alt="{len(bodies)} objects" src="data:image/png;base64,{data}"/>'


def table_html(rows: Mapping[str, str]) -> str:
    """A table of two columns, names and values, both escaped."""
    lines = (
        f'<tr><th style="text-align:left">{escape(name)}</th><td style="text-align:left">{escape(value)}</td></tr>'
        for name, value in rows.items()
    )
    return f"<table>{''.join(lines)}</table>"
