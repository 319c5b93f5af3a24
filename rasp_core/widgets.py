"""Sliders for notebooks. The only module that imports ipywidgets; what they do are plain functions."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np

from . import show
from .arrange import Arrangement, arrange
from .certify import certify
from .density import mesh_density
from .problem import Problem, Settings
from .scene import Scene


def rerun(problem: Problem, settings: Settings, lambda_: float, epsilon: float, scene: Scene | None = None):
    """Arrange with other lambda and epsilon: the arrangement, its picture (PNG bytes) and one line of facts."""
    arrangement = arrange(problem, replace(settings, lambda_=lambda_, epsilon=epsilon), scene=scene)
    return arrangement, picture(arrangement), facts_line(arrangement)


def picture(arrangement: Arrangement) -> bytes:
    """The arrangement in 3D beside its silhouettes against their targets, as PNG."""
    from matplotlib.figure import Figure

    bodies, matrices = arrangement.problem.bodies, arrangement.matrices
    views = len(arrangement.images)
    figure = Figure(figsize=(4 + 2 * views, 3.6), layout="constrained")
    axes = figure.subplots(1, 1 + views, width_ratios=[2] + [1] * views)
    axes[0].imshow(show.scene_picture(bodies, matrices, arrangement.problem.container, (700, 600)))
    for axis, image, target in zip(axes[1:], arrangement.images, arrangement.targets, strict=True):
        axis.imshow(np.stack([1 - image, 1 - (image + target) / 2, 1 - target], -1).clip(0, 1))
    for axis, title in zip(axes, ["arrangement", *["shadow (orange: missing, blue: outside)"] * views], strict=True):
        axis.set_title(title, fontsize=7)
        axis.set_axis_off()
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=90)
    return buffer.getvalue()


def facts_line(arrangement: Arrangement) -> str:
    """Losses and certificate in one line."""
    bodies, container = arrangement.problem.bodies, arrangement.problem.container
    certificate = certify(bodies, arrangement.matrices, container)
    shared = certificate.overlap_volume / sum(body.volume for body in bodies)
    out = certificate.protrusion_volume / sum(body.volume for body in bodies)
    return (
        f"density {mesh_density(bodies, container):.3f}; volume shared {shared:.2%}, sticking out {out:.2%}; "
        f"silhouette loss {arrangement.history[-1, 1]:.4f}"
    )


def lambda_epsilon_sliders(problem: Problem, settings: Settings):
    """Logarithmic sliders for lambda and epsilon, a button that reruns, and the picture and facts of the last run."""
    import ipywidgets

    scene = problem.scene()
    wide = {"description_width": "90px"}
    lambda_ = ipywidgets.FloatLogSlider(settings.lambda_, min=-4, max=2, description="lambda", style=wide)
    epsilon = ipywidgets.FloatLogSlider(settings.epsilon, min=-4, max=-1, description="epsilon (m)", style=wide)
    button = ipywidgets.Button(description="Run", button_style="primary")
    image, label = ipywidgets.Image(format="png"), ipywidgets.Label()

    def press(_button):
        button.disabled, label.value = True, "running ..."
        try:
            _, image.value, label.value = rerun(problem, settings, lambda_.value, epsilon.value, scene)
        finally:
            button.disabled = False

    button.on_click(press)
    press(button)
    return ipywidgets.VBox([ipywidgets.HBox([lambda_, epsilon, button]), label, image])
