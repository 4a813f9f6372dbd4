"""Where the yarns of a fabric overlap."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray

from plycloth._check import NON_NEGATIVE, POSITIVE, array, instance, number
from plycloth._value import Description
from plycloth.weave import WeavePattern

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AnyPattern = Annotated[WeavePattern, instance(WeavePattern)]
Depths = Annotated[NDArray[np.float64], array((None, None), NON_NEGATIVE)]
Length = Annotated[float, number(POSITIVE)]

# As in plycloth's core (src/cloth/fitting.rs).
TOLERANCE = 0.02
"""An overlap of at most this part of the thinner yarn's thickness counts as none."""

WORTH_A_WARNING = 0.1
"""One of more than this part of it shows as a cut."""


class OverlapWarning(UserWarning):
    """Yarns of a fabric pass through each other, or had to become very narrow not to."""


@dataclass(frozen=True, eq=False, repr=False)
class Overlaps(Description):
    """How deep the yarns of a fabric overlap, as `Fabric.overlaps` finds it.

    Attributes
    ----------
    pattern : WeavePattern
        The fabric's.
    depth_mm : ndarray, shape (picks, ends)
        For each crossing how deep one of its yarns reaches into the other there, or into the next
        of its own set, in millimetres; 0 where they are apart. Yarns are taken as the ellipses
        around their plies, ribbons as sheets.
    thickness_mm : float
        Thickness of the thinner yarn.
    """

    pattern: AnyPattern
    depth_mm: Depths
    thickness_mm: Length

    @property
    def count(self) -> int:
        """Crossings with an overlap of more than 2% of the thinner yarn's thickness."""
        return int(np.count_nonzero(self.depth_mm > TOLERANCE * self.thickness_mm))

    @property
    def share(self) -> float:
        """Those crossings as a part of all."""
        return self.count / self.depth_mm.size

    @property
    def worst_mm(self) -> float:
        """Depth of the deepest overlap in millimetres."""
        return float(self.depth_mm.max())

    @property
    def worst(self) -> float:
        """Depth of the deepest overlap as a part of the thinner yarn's thickness."""
        return self.worst_mm / self.thickness_mm

    def __str__(self) -> str:
        # A ribbon is thin, and may lie deep in a round yarn.
        part = "more than" if self.worst > 1.0 else f"{self.worst:.0%} of"
        return (
            f"yarns overlap at {self.count} of {self.depth_mm.size} crossings, by up to"
            f" {self.worst_mm:.3g} mm ({part} the thinner yarn's thickness)"
        )

    def plot(self) -> Figure:
        """Draw the depths over the drawdown, the first pick at the top; dark is the warp."""
        from matplotlib.figure import Figure

        figure = Figure(figsize=(6, 5), layout="constrained")
        axes = figure.subplots()
        axes.imshow(np.where(self.pattern.warp_up, 0.45, 0.9), cmap="gray", vmin=0.0, vmax=1.0)
        percent = 100.0 * self.depth_mm / self.thickness_mm
        shown = np.ma.masked_less_equal(percent, 100.0 * TOLERANCE)
        image = axes.imshow(shown, cmap="autumn_r", vmin=0.0, vmax=max(100.0 * self.worst, 1.0))
        figure.colorbar(image, label="overlap, % of the thinner yarn's thickness")
        axes.set(xlabel="end", ylabel="pick", title=f"{self.count} of {self.depth_mm.size}")
        return figure

    def _repr_html_(self) -> str:
        data = io.StringIO()
        self.plot().savefig(data, format="svg")
        drawing = data.getvalue()
        text = str(self)
        return f"<p>{text[0].upper()}{text[1:]}.</p>{drawing[drawing.index('<svg') :]}"
