"""What the door gives: objects at poses in a container, certified.

One protocol for packing, assembly, art and the bare loop: `bodies`, `matrices`, `poses`, `container`, `certificate`,
`density`, `history`, and `show()`, `plot()`, `save(folder)`. A notebook shows a result as a picture and a small table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..exact.certified import Certified

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from PIL.Image import Image


@dataclass(frozen=True, repr=False)
class Result(Certified):
    """Objects at poses in a container, certified. seconds : that it took."""

    seconds: float

    @property
    def history(self) -> np.ndarray:
        """`(I, 5)` losses, a row an iteration, columns `objective.LOSS_NAMES`."""
        return self.arrangement.history

    @property
    def gradient_shares(self) -> dict[str, float]:
        """Each term's share of the gradient with respect to translations, in the mean over the run; 0 without one."""
        return self.arrangement.gradient_shares

    @property
    def verdict(self) -> str:
        """Whether the certificate holds, in words."""
        if self.certificate.holds:
            return "certified"
        faults, gaps = (len(self.certificate.overlaps), len(self.certificate.protrusions)), self.certificate.gaps
        apart = "" if gaps is None else f", {len(gaps.short)} gaps are too small"
        return f"not certified: {faults[0]} pairs overlap, {faults[1]} stick out{apart}"

    def headline(self) -> str:
        """What it is, in one line."""
        return f"Arrangement of {len(self.bodies)} objects, density {self.density:.3f}, {self.verdict}"

    def table(self) -> dict[str, str]:
        """Its facts in words, for a small table."""
        return {
            "objects": str(len(self.bodies)),
            "density (Eq. 6)": f"{self.density:.4f}",
            "certificate": self.verdict,
            "worst overlap, of the smaller": f"{self.certificate.worst_overlap:.1e}",
            "worst protrusion": f"{self.certificate.worst_protrusion:.1e}",
            "iterations": str(len(self.history)),
        }

    def record(self) -> dict:
        """Further entries of result.json, as plain values."""
        return {"density": self.density, "seconds": self.seconds}

    def show(self, size: tuple[int, int] = (800, 700), **look) -> Image:
        """A picture in 3D, which a notebook shows; `.save("picture.png")` keeps it.

        size : pixels, width and height. look : further arguments of `visualize.scene3d.Stage`, such as azimuth_deg.
        """
        from PIL import Image

        from ..visualize.scene3d import scene_picture

        return Image.fromarray(scene_picture(self.bodies, self.matrices, self.container, size, **look))

    def plot(self) -> Figure:
        """A matplotlib figure: target, rendered and difference for each view, and the losses."""
        from ..visualize.plots import overview_figure

        return overview_figure(self.arrangement, self.history)

    def save(self, folder: str | Path, facts: Mapping | None = None) -> Path:
        """Write a run's folder: scene.glb, result.json, history.csv, silhouettes.png; returns its path.

        facts : further entries of result.json. Raises InputError if the folder cannot be written.
        """
        from .run_folder import save_run

        return save_run(folder, self.arrangement, self.certificate, self.record() | dict(facts or {}), self.history)

    def __repr__(self) -> str:
        return f"<{self.headline()}>"

    def _repr_html_(self) -> str:
        from ..visualize.summary import picture_html, table_html

        return picture_html(self.bodies, self.matrices, self.container) + table_html(self.table())
