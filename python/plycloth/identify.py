"""What pictures tell about each unknown of a fit, and which unknowns trade with each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from plycloth.pool import Pool

FloatArray = NDArray[np.float64]

# Directions that change the picture less than this (relative to the strongest) are unidentifiable.
LEAST_SENSITIVITY = 1e-3
# Where no unknown changes the pictures at all, there still is something to divide by.
LEAST_CURVATURE = 1e-60
# Errors of unknowns that are more correlated than this are said to trade with each other.
LEAST_CORRELATION = 0.5
MOST_PARTNERS = 3
# Unknowns, all in [0, 1], that may be off by more than this are not told by the pictures.
MOST_UNCERTAIN = 0.25
CHANNELS = 3


def identify(
    pooled: Pool, noise: float, labels: Sequence[str]
) -> tuple[FloatArray, NDArray[np.bool_], list[tuple[str, ...]]]:
    """Return how far off each unknown may be, which cannot be told at all, and its partners.

    What is left of the slopes' own noise shows as negative curvature; what is not larger than that
    is weak. Standard errors follow from what the fit left in each cell, whose channels are off
    together and whose noise may differ from cell to cell (Liang and Zeger 1986, "Longitudinal data
    analysis using generalized linear models"), beside `noise` in every residual.

    Parameters
    ----------
    pooled
        What was seen at the end of the fit; residuals channel by channel.
    noise
        Standard deviation of each residual that is taken for granted.
    labels
        Names of the unknowns.
    """
    curvatures, directions = np.linalg.eigh(pooled.curvature)
    strongest = max(float(curvatures[-1]), LEAST_CURVATURE)
    floor = max(LEAST_SENSITIVITY**2 * strongest, -2.0 * float(curvatures[0]))
    weak = curvatures < floor
    told = (directions / np.maximum(curvatures, floor)) @ directions.T
    pulls = (pooled.slopes * pooled.residuals[:, None]).reshape(-1, CHANNELS, len(labels)).sum(1)
    # Along weak directions nothing holds an unknown: those in them go together.
    free = (directions / np.where(weak, 1e-3 * floor, curvatures)) @ directions.T
    covariance = told @ (pulls.T @ pulls) @ told + noise**2 * free
    deviations = np.sqrt(np.diagonal(covariance))
    in_weak = (directions[:, weak] ** 2).sum(1) > 0.1
    return deviations, in_weak | (deviations > MOST_UNCERTAIN), _partners(covariance, labels)


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
