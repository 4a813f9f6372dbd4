"""Drawings of relaxed yarns."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from plycloth.relax import Relaxed

FloatArray = NDArray[np.float64]

POINTS_PER_SEGMENT = 8


def plot_relaxed(relaxed: "Relaxed", *, ends: int = 4) -> "Figure":
    """Draw the first ends from the side, and the picks that they cross as dots.

    Parameters
    ----------
    relaxed
        What to draw.
    ends
        How many ends, at least 1; no more than there are.

    Raises
    ------
    ValueError
        If `ends` is less than 1.
    """
    from matplotlib.figure import Figure

    if ends < 1:
        raise ValueError(f"ends must be at least 1, not {ends}")
    count = min(ends, len(relaxed.warp_height))
    knots = knot_positions(relaxed.weft_spacing)
    figure = Figure(figsize=(8, 1.0 * count + 0.6), layout="constrained")
    rows = figure.subplots(count, 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for end, axes in enumerate(rows):
        axes.plot(*yarn_curve(knots, relaxed.warp_height[end], relaxed.warp_slope[end]), lw=3)
        axes.plot(knots[1::2], relaxed.weft_height[:, 2 * end + 1], "o", ms=7, color="tab:orange")
        axes.set_ylabel(f"end {end + 1}")
    rows[-1].set_xlabel("along the end, over the picks")
    return figure


def knot_positions(spacing: ArrayLike) -> FloatArray:
    """Positions of a period's knots, both ends included: slot borders and slot middles."""
    borders = np.concatenate([[0.0], np.cumsum(spacing)])
    knots = np.empty(2 * len(borders) - 1)
    knots[0::2] = borders
    knots[1::2] = 0.5 * (borders[:-1] + borders[1:])
    return knots


def yarn_curve(
    knots: FloatArray, heights: FloatArray, slopes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Evaluate the cubic Hermite curve of a periodic yarn, densely over one period."""
    heights, slopes = (np.append(values, values[0]) for values in (heights, slopes))
    t = np.linspace(0.0, 1.0, POINTS_PER_SEGMENT, endpoint=False)
    width = np.diff(knots)[:, None]
    start, end = heights[:-1, None], heights[1:, None]
    start_slope, end_slope = slopes[:-1, None] * width, slopes[1:, None] * width
    y = (
        (2 * t**3 - 3 * t**2 + 1) * start
        + (t**3 - 2 * t**2 + t) * start_slope
        + (3 * t**2 - 2 * t**3) * end
        + (t**3 - t**2) * end_slope
    )
    x = knots[:-1, None] + t * width
    return np.append(x, knots[-1]), np.append(y, heights[-1])
