"""Pearson's test that directions were drawn with the density that a model claims."""

import numpy as np
from scipy import stats

ROWS, COLUMNS = 12, 16  # bins of equal solid angle over the sphere
LEAST_COUNT = 5.0  # bins that expect less are pooled


def sphere(z, azimuth):
    """Unit vectors of heights z and azimuths."""
    radius = np.sqrt(np.maximum(0.0, 1.0 - z * z))
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], axis=-1)


def p_value(directions, pdf, draws, points):
    """The probability of a fit as bad as this one.

    `directions` are those of `draws` samples that did not fail, `pdf` a function of n x 3
    directions; what it lacks to one is the probability of failing. The expected counts come from
    `points` x `points` midpoints in each bin: densities with a sharp edge need many.
    """
    counts, *_ = np.histogram2d(
        directions[:, 2],
        np.arctan2(directions[:, 1], directions[:, 0]),
        bins=(ROWS, COLUMNS),
        range=((-1, 1), (-np.pi, np.pi)),
    )
    z = (np.arange(ROWS * points) + 0.5) / (ROWS * points) * 2 - 1
    azimuth = ((np.arange(COLUMNS * points) + 0.5) / (COLUMNS * points) * 2 - 1) * np.pi
    grid = sphere(*np.meshgrid(z, azimuth, indexing="ij")).reshape(-1, 3)
    density = pdf(grid).reshape(ROWS, points, COLUMNS, points).mean(axis=(1, 3))
    expected = draws * density * 4 * np.pi / (ROWS * COLUMNS)
    counts = np.append(counts.ravel(), draws - len(directions))
    expected = np.append(expected.ravel(), draws - expected.sum())
    pooled = expected < LEAST_COUNT
    counts = np.append(counts[~pooled], counts[pooled].sum())
    expected = np.append(expected[~pooled], max(expected[pooled].sum(), 1.0))
    statistic = ((counts - expected) ** 2 / expected).sum()
    return stats.chi2.sf(statistic, len(counts) - 1)
