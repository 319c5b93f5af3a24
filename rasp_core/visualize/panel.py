"""A panel of sliders that drives a `live.LiveRun`, and its picture. The only module that imports ipywidgets."""

from __future__ import annotations

import base64
import io
from collections import deque
from collections.abc import Sequence
from contextlib import closing

import numpy as np

from .. import losses
from ..geometry.containers import Container
from ..geometry.meshes import Body
from ..objective import LOSS_NAMES
from ..problem import WEIGHTINGS, Settings
from . import scene3d
from .live import Controls, Frame, LiveRun

SCENE = (400, 380)  # pixels of the arrangement in 3D
WIDTH, HEIGHT = 960, 400  # of the whole picture
CURVES = (1, 2, 3)  # columns of the history that are drawn
COLOURS = "#1f77b4", "#d62728", "#2ca02c"


class Picture:
    """Draws the frames of a run, all from one thread: the arrangement in 3D, its silhouettes against their targets, the
    losses so far. Plain text, as an SVG."""

    def __init__(self, pool: Sequence[Body], container: Container):
        self.pool, self.container = list(pool), container
        self._stage, self._count = None, 0

    def draw(self, frame: Frame) -> str:
        """The frame's picture."""
        if self._stage is None or self._count != len(frame.matrices):
            self.close()
            self._count = len(frame.matrices)
            bodies = self.pool[: self._count]
            self._stage = scene3d.Stage(bodies, frame.matrices, self.container, SCENE)
        parts = [_image(self._stage.picture(frame.matrices), 0, 20, *SCENE, "jpeg")]
        edge = min(170, (WIDTH - SCENE[0] - 10) // len(frame.images) - 10)
        for k, (image, target) in enumerate(zip(frame.images, frame.targets, strict=True)):
            both = np.stack([1 - image, 1 - (image + target) / 2, 1 - target], -1)
            place = SCENE[0] + 10 + k * (edge + 10), 24, edge, edge
            parts.append(_image((255 * both.clip(0, 1)).astype(np.uint8), *place, "png"))
        parts.append(_words(SCENE[0] + 10, 14, "shadows: black as wanted, orange missing, blue too much"))
        parts.append(_words(10, 14, f"{self._count} objects"))
        wide = (WIDTH - SCENE[0] - 10) / len(CURVES)
        for n, (column, colour) in enumerate(zip(CURVES, COLOURS, strict=True)):
            place = SCENE[0] + 10 + n * wide, 232, wide - 14, 150
            parts.append(_curve(frame.history[:, column], LOSS_NAMES[column], colour, *place))
        head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" font-family="sans-serif">'
        return head + '<rect width="100%" height="100%" fill="white"/>' + "".join(parts) + "</svg>"

    def close(self) -> None:
        """Give the drawing memory back."""
        if self._stage is not None:
            self._stage.close()
            self._stage = None


def facts_line(frame: Frame) -> str:
    """A frame's numbers, in one line."""
    last = dict(zip(LOSS_NAMES, frame.history[-1], strict=True)) if len(frame.history) else {}
    text = f"iteration {len(frame.history)}: {frame.density:.1%} of the container filled, {frame.overlap:.2%} twice"
    if last:
        text += f"; silhouette loss {last['silhouette']:.4f}"
    if frame.certificate is not None:
        found = len(frame.certificate.overlaps), len(frame.certificate.protrusions)
        text += f"; exact booleans: {found[0]} pairs overlap, {found[1]} objects stick out"
    return text


def still(
    pool: Sequence[Body], container: Container, controls: Controls | None = None, settings: Settings | None = None
) -> tuple[str, Frame]:
    """The panel's picture for readers without a kernel: the run to its end, its last frame as SVG, and the frame.
    Raises InputError as `live.LiveRun` does."""
    frames: deque[Frame] = deque(maxlen=1)
    with closing(LiveRun(pool, container, controls, settings, frames.append)) as live:
        live.run()
        live.wait()
    picture = Picture(pool, container)
    try:
        return picture.draw(frames[0]), frames[0]
    finally:
        picture.close()


def panel(
    pool: Sequence[Body], container: Container, controls: Controls | None = None, settings: Settings | None = None
):
    """Sliders for what `live.Controls` holds, Run, Pause, Step and Reset, and the live picture and its numbers.

    An ipywidgets box, with the run as its attribute `live`. Raises InputError as `live.LiveRun` does.

    >>> import rasp_core as rasp
    >>> from data_fetch import kitchen_like
    >>> controls = rasp.panel(kitchen_like(3), rasp.box(0.3, 0.3, 0.3))
    >>> controls.live.controls.count
    3
    >>> controls.live.close()
    """
    import ipywidgets

    image, label = ipywidgets.Image(format="svg+xml"), ipywidgets.Label()
    picture = Picture(pool, container)

    def watch(frame: Frame) -> None:
        image.value, label.value = picture.draw(frame).encode(), facts_line(frame)

    live = LiveRun(pool, container, controls, settings, watch)
    now, wide = live.controls, {"style": {"description_width": "110px"}}
    sliders = {
        "weighting": ipywidgets.Dropdown(
            value=now.weighting, options=list(WEIGHTINGS), description="weighting", **wide
        ),
        "lambda_": ipywidgets.FloatLogSlider(now.lambda_, min=-4, max=2, description="lambda", **wide),
        "epsilon": ipywidgets.FloatLogSlider(now.epsilon, min=-4, max=-1, description="epsilon (m)", **wide),
        "height": ipywidgets.FloatSlider(now.height, min=0.2, max=1, description="target height", **wide),
        "count": ipywidgets.IntSlider(now.count, min=1, max=len(pool), description="objects", **wide),
        "seed": ipywidgets.IntSlider(now.seed, min=0, max=20, description="seed", **wide),
        "overlap_term": ipywidgets.Dropdown(
            value=now.overlap_term, options=losses.OVERLAP_TERMS, description="overlap term", **wide
        ),
    }
    for name, slider in sliders.items():
        slider.observe(lambda change, name=name: live.change(**{name: change["new"]}), "value")
    buttons = []
    for name in ("run", "pause", "step", "reset"):
        button = ipywidgets.Button(description=name.capitalize(), button_style="primary" if name == "run" else "")
        button.on_click(lambda _button, name=name: getattr(live, name)())
        buttons.append(button)
    rows = list(sliders.values())
    box = ipywidgets.VBox(
        [
            ipywidgets.HBox([ipywidgets.VBox(rows[:4]), ipywidgets.VBox(rows[4:])]),
            ipywidgets.HBox(buttons),
            label,
            image,
        ]
    )
    box.live = live
    live.reset()  # draws the random poses
    live.wait()
    return box


def _image(pixels: np.ndarray, x: float, y: float, wide: float, high: float, kind: str) -> str:
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, kind, **({"quality": 88} if kind == "jpeg" else {"compress_level": 1}))
    text = base64.b64encode(buffer.getvalue()).decode()
    return f'<image x="{x:g}" y="{y:g}" width="{wide:g}" height="{high:g}" href="data:image/{kind};base64,{text}"/>'


def _words(x: float, y: float, text: str, size: int = 12, anchor: str = "start") -> str:
    return f'<text x="{x:g}" y="{y:g}" font-size="{size}" text-anchor="{anchor}" fill="#333">{text}</text>'


def _curve(values: np.ndarray, name: str, colour: str, x: float, y: float, wide: float, high: float) -> str:
    """A loss over the iterations, from 0 or the least to the largest; the last value in words."""
    parts = [f'<rect x="{x:g}" y="{y:g}" width="{wide:g}" height="{high:g}" fill="none" stroke="#bbb"/>']
    title = name if not len(values) else f"{name} {values[-1]:.3g}"
    parts.append(_words(x, y - 5, title))
    if len(values) > 1:
        at = np.unique(np.linspace(0, len(values) - 1, 200).astype(int))
        low, top = min(0.0, float(values.min())), float(values.max())
        across = x + wide * at / (len(values) - 1)
        up = y + high - high * (values[at] - low) / max(top - low, 1e-12)
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, up, strict=True))
        parts.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
        parts.append(_words(x + 4, y + 12, f"{top:.3g}", 10))
        parts.append(_words(x + wide, y + high + 13, f"{len(values)} iterations", 10, "end"))
    return "".join(parts)
