"""Pictures as averages over a grid of cells, and what a lens does to them."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# A lens's falloff is averaged over so many points a side of each cell.
FINE = 8


def cell_averages(pixels: FloatArray, cells: int) -> FloatArray:
    """Average H x W x 3 pixels over cells x cells; a pixel counts for the cell of its middle."""
    rows, columns = ((np.arange(n) * 2 + 1) * cells // (2 * n) for n in pixels.shape[:2])
    sums = np.zeros((cells, cells, 3))
    np.add.at(sums, (rows[:, None], columns[None, :]), pixels)
    counts = np.bincount(rows, minlength=cells)[:, None] * np.bincount(columns, minlength=cells)
    return np.asarray(sums / counts[..., None])


def distance2(height: int, width: int) -> FloatArray:
    """Return each pixel's squared distance from the picture's middle, 1 in its corners."""
    y, x = (2.0 * (np.arange(n) + 0.5) / n - 1.0 for n in (height, width))
    return np.asarray(0.5 * (y[:, None] ** 2 + x[None, :] ** 2))


def lens_gain(
    shape: tuple[int, ...], exposure: float, falloff: float
) -> tuple[FloatArray, FloatArray]:
    """Return exposure * exp(-falloff d^2), averaged over cells, and its derivative by falloff.

    Parameters
    ----------
    shape
        Rows and columns of cells.
    exposure, falloff
        Numbers of at least 0; d is the distance from the picture's middle, 1 in its corners.

    Returns
    -------
    Two arrays of rows x columns x 1.
    """
    d2 = distance2(shape[0] * FINE, shape[1] * FINE)
    factor = exposure * np.exp(-falloff * d2)

    def averages(values: FloatArray) -> FloatArray:
        blocks = values.reshape(shape[0], FINE, shape[1], FINE)
        return np.asarray(blocks.mean((1, 3))[..., None])

    return averages(factor), averages(-d2 * factor)
