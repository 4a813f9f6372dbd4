"""What pictures tell about each unknown of a fit, and which unknowns trade with each other."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# Directions that change the picture less than this (relative to the strongest) are unidentifiable.
LEAST_SENSITIVITY = 1e-3
# Errors of unknowns that are more correlated than this are said to trade with each other.
LEAST_CORRELATION = 0.5
MOST_PARTNERS = 3


def identify(
    first: FloatArray, second: FloatArray, noise: float, labels: Sequence[str]
) -> tuple[FloatArray, NDArray[np.bool_], list[tuple[str, ...]]]:
    """Return how far off noise puts each unknown, which cannot be told at all, and its partners.

    The curvature is the product of both halves' slopes: their own noise, which makes slopes where
    there are none, does not add to it. What is left of that noise shows as negative curvature.

    Parameters
    ----------
    first, second
        Slopes of the residuals by independent paths, residuals x unknowns.
    noise
        Standard deviation of each residual.
    labels
        Names of the unknowns.
    """
    product = first.T @ second
    curvatures, directions = np.linalg.eigh(0.5 * (product + product.T))
    strongest = max(float(curvatures[-1]), np.finfo(float).tiny)
    floor = max(LEAST_SENSITIVITY**2 * strongest, -2.0 * float(curvatures[0]))
    weak = curvatures < floor
    spread = noise / np.sqrt(np.where(weak, 1e-3 * floor, curvatures))
    factor = directions * spread
    covariance = factor @ factor.T
    deviations = np.sqrt(np.diagonal(covariance))
    in_weak = (directions[:, weak] ** 2).sum(1) > 0.1
    return deviations, in_weak, _partners(covariance, labels)


def _partners(covariance: FloatArray, labels: Sequence[str]) -> list[tuple[str, ...]]:
    """Return for each unknown those, at most `MOST_PARTNERS`, that it is most correlated with."""
    deviations = np.sqrt(np.maximum(np.diagonal(covariance), np.finfo(float).tiny))
    correlation = np.abs(covariance / np.outer(deviations, deviations))
    np.fill_diagonal(correlation, 0.0)
    order = np.argsort(-correlation, axis=1)[:, :MOST_PARTNERS]
    return [
        tuple(labels[j] for j in row if correlation[i, j] >= LEAST_CORRELATION)
        for i, row in enumerate(order)
    ]
