"""What several independent sets of random paths say together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# Residuals count as linear in the unknowns (all in [0, 1]) over this distance.
LINEAR_RADIUS = 0.1


@dataclass(frozen=True)
class Linear:
    """Residuals at a point, and their slopes (residuals x unknowns), by some random paths."""

    u: FloatArray
    residuals: FloatArray
    slopes: FloatArray

    def at(self, u: FloatArray) -> FloatArray:
        """Return the residuals at another point, to first order."""
        return self.residuals + self.slopes @ (u - self.u)


@dataclass(frozen=True)
class Pool:
    """Means over independent sets of paths, at one point.

    Parameters
    ----------
    residuals, slopes
        The means.
    gradient, curvature
        Of the sum of squared residuals: its gradient, and the half of its curvature that slopes
        make. Only products of different sets are in them, to which noise does not add; the
        curvature may therefore be a little negative.
    """

    residuals: FloatArray
    slopes: FloatArray
    gradient: FloatArray
    curvature: FloatArray


def nearby(seen: Sequence[Linear], u: FloatArray) -> list[Linear]:
    """Return what was seen where residuals still are linear around `u`."""
    return [each for each in seen if np.abs(each.u - u).max() <= LINEAR_RADIUS]


def pool(seen: Sequence[Linear], u: FloatArray) -> Pool:
    """Pool what two or more independent sets of paths have seen, at `u`."""
    count = len(seen)
    residuals = np.mean([each.at(u) for each in seen], axis=0)
    slopes = np.mean([each.slopes for each in seen], axis=0)
    pulls = np.mean([each.slopes.T @ each.at(u) for each in seen], axis=0)
    squares = np.mean([each.slopes.T @ each.slopes for each in seen], axis=0)
    gradient = 2.0 * (count * slopes.T @ residuals - pulls) / (count - 1)
    curvature = (count * slopes.T @ slopes - squares) / (count - 1)
    return Pool(residuals, slopes, gradient, curvature)
