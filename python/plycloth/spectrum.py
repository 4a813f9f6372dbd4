"""The peaks in a photograph's spectrum that regular cloth leaves."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

LARGEST_TILE = 256
# Averaged over at least nine tiles, white noise alone stays below this times its median.
LEAST_PROMINENCE = 10.0
# Next to a strong peak, what is this much weaker is its own skirt: real threads are not parallel.
LARGEST_RATIO = 150.0
MOST_PEAKS = 14
# Below so many periods per tile there is lighting and folds, not threads.
LEAST_PERIODS = 5


@dataclass(frozen=True)
class Peak:
    """A regular pattern that stands out.

    Attributes
    ----------
    frequency : tuple of float
        Periods per pixel along x (to the right) and y (downwards); y is not negative.
    prominence : float
        Power over the median power at the same distance from the origin.
    """

    frequency: tuple[float, float]
    prominence: float


def prominence(light: FloatArray) -> FloatArray:
    """Averaged power spectrum, divided by its median over every ring of equal frequency.

    Welch's method on the logarithm of the light, so that lighting, which is a factor, becomes an
    offset that varies slowly: Hann windows, half overlapping, at least three by three of them.

    Parameters
    ----------
    light : ndarray, (height, width)
        Linear, not negative.

    Returns
    -------
    ndarray, (n, n)
        The zero frequency is at [n // 2, n // 2]; n is even.
    """
    tile = min(LARGEST_TILE, min(light.shape) // 4 * 2)
    density = np.log(light + 0.02 * light.mean() + np.finfo(float).tiny)
    power = np.fft.fftshift(_mean_power(density, tile))
    rings = np.round(np.hypot(*np.meshgrid(*[np.arange(tile) - tile // 2] * 2)) / 4).astype(int)
    medians = np.array([np.median(power[rings == ring]) for ring in range(rings.max() + 1)])
    # A picture without any noise has empty rings, and rounding errors are no peaks.
    floor = 1e-12 * power.max() + np.finfo(float).tiny
    result: FloatArray = power / np.maximum(medians, floor)[rings]
    return result


def find_peaks(prominence: FloatArray) -> tuple[Peak, ...]:
    """Local maxima that stand out, the strongest first; one of each pair of opposite ones."""
    tile = len(prominence)
    lines, columns = np.indices(prominence.shape) - tile // 2
    neighbours = [
        np.roll(prominence, (dy, dx), (0, 1)) for dy in range(-2, 3) for dx in range(-2, 3)
    ]
    wanted = (
        (prominence == np.max(neighbours, axis=0))
        & (np.hypot(lines, columns) >= LEAST_PERIODS)
        & ((lines > 0) | ((lines == 0) & (columns > 0)))
    )
    strengths = prominence[wanted]
    if not strengths.size:
        return ()
    limit = max(LEAST_PROMINENCE, strengths.max() / LARGEST_RATIO)
    found = np.argwhere(wanted & (prominence >= limit))
    ranked = sorted(found.tolist(), key=lambda place: -prominence[tuple(place)])
    return tuple(_refined(prominence, line, column) for line, column in ranked[:MOST_PEAKS])


def _mean_power(density: FloatArray, tile: int) -> FloatArray:
    hann = 0.5 - 0.5 * np.cos(2 * np.pi * (np.arange(tile) + 0.5) / tile)
    window = np.outer(hann, hann)
    starts = [
        np.linspace(0, size - tile, max(3, size * 2 // tile - 1)).astype(int)
        for size in density.shape
    ]
    power = np.zeros((tile, tile))
    for top in starts[0]:
        for left in starts[1]:
            patch = density[top : top + tile, left : left + tile]
            power += np.abs(np.fft.fft2((patch - patch.mean()) * window)) ** 2
    return power


def _refined(prominence: FloatArray, line: int, column: int) -> Peak:
    tile = len(prominence)
    logs = np.log(np.take(prominence, range(line - 1, line + 2), 0, mode="wrap"))
    logs = np.take(logs, range(column - 1, column + 2), 1, mode="wrap")
    y = (line - tile // 2 + _vertex(logs[:, 1])) / tile
    x = (column - tile // 2 + _vertex(logs[1])) / tile
    return Peak((float(x), float(y)), float(prominence[line, column]))


def _vertex(three: FloatArray) -> float:
    """Where the parabola through three values at -1, 0 and 1 is highest."""
    curvature = three[0] - 2 * three[1] + three[2]
    return float(0.5 * (three[0] - three[2]) / curvature) if curvature < 0 else 0.0
